//! Formats of the archives that teams upload. A *bundle* is such an archive: an agent's files, or a container image.

/// Archive formats that bundles are accepted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArchiveFormat {
    /// `.tar.gz`
    TarGz,
    /// `.tar.zst`
    TarZst,
    /// `.zip`
    Zip,
    /// `.tar`, as `docker save` writes a container image. An agent's files are only accepted in the compressed formats.
    Tar,
}

impl ArchiveFormat {
    /// Number of bytes from an archive's start that suffice to detect every format. All but [`Self::Tar`] need only
    /// four, so [`Self::detect`] also accepts fewer.
    pub const DETECTION_BYTES: usize = TAR_MAGIC_OFFSET + TAR_MAGIC.len();

    /// Detects the format from an archive's first bytes; file names are not trusted.
    #[must_use]
    pub fn detect(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::TarGz),
            // The second pattern is a skippable frame, with which some compressors begin.
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => {
                Some(Self::TarZst)
            }
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            _ => (head.get(TAR_MAGIC_OFFSET..Self::DETECTION_BYTES) == Some(TAR_MAGIC))
                .then_some(Self::Tar),
        }
    }

    /// Usual file extension, without the dot.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::TarGz => "tar.gz",
            Self::TarZst => "tar.zst",
            Self::Zip => "zip",
            Self::Tar => "tar",
        }
    }

    /// Accepted file extensions, with the dot.
    #[must_use]
    pub const fn accepted_extensions(self) -> &'static [&'static str] {
        match self {
            Self::TarGz => &[".tar.gz", ".tgz"],
            Self::TarZst => &[".tar.zst", ".tzst"],
            Self::Zip => &[".zip"],
            Self::Tar => &[".tar"],
        }
    }
}

/// Magic bytes in the header of the first entry. The bytes after them differ between GNU and POSIX tar.
const TAR_MAGIC: &[u8] = b"ustar";
/// Offset of these bytes from the start of the archive.
const TAR_MAGIC_OFFSET: usize = 257;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detect_recognises_formats_by_first_bytes() {
        let detect = ArchiveFormat::detect;
        assert_eq!(detect(&[0x1f, 0x8b, 8, 0]), Some(ArchiveFormat::TarGz));
        assert_eq!(
            detect(&[0x28, 0xb5, 0x2f, 0xfd]),
            Some(ArchiveFormat::TarZst)
        );
        assert_eq!(detect(b"PK\x03\x04"), Some(ArchiveFormat::Zip));
        assert_eq!(detect(b"PK\x05\x06"), None, "an empty zip holds no agent");
        assert_eq!(detect(b"<htm"), None);
    }

    #[test]
    fn detect_recognises_gnu_and_posix_tar_headers() {
        for magic in [b"ustar  \0", b"ustar\x0000"] {
            let mut head = vec![0; 512];
            head[..13].copy_from_slice(b"manifest.json");
            head[257..265].copy_from_slice(magic);
            let detect = |bytes: usize| ArchiveFormat::detect(&head[..bytes]);
            assert_eq!(detect(512), Some(ArchiveFormat::Tar));
            assert_eq!(
                detect(ArchiveFormat::DETECTION_BYTES),
                Some(ArchiveFormat::Tar)
            );
            assert_eq!(detect(ArchiveFormat::DETECTION_BYTES - 1), None);
        }
        assert_eq!(ArchiveFormat::detect(&[0; 512]), None);
    }
}

/// The archives in which a bundle may come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArchiveFormat {
    /// `.tar.gz`
    TarGz,
    /// `.tar.zst`
    TarZst,
    /// `.zip`
    Zip,
    /// `.tar`, as `docker save` writes a container image; a bundle of files comes compressed.
    Tar,
}

impl ArchiveFormat {
    /// So many first bytes tell any of them. All but [`Self::Tar`] are told by four, so that a shorter head
    /// may be asked about, too.
    pub const LONGEST_MAGIC: usize = TAR_MAGIC_AT + TAR_MAGIC.len();

    /// Told by its first bytes, whatever its name says.
    #[must_use]
    pub fn detect(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::TarGz),
            // Or a frame that is to be skipped, with which some compressors begin.
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => {
                Some(Self::TarZst)
            }
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            _ => (head.get(TAR_MAGIC_AT..Self::LONGEST_MAGIC) == Some(TAR_MAGIC))
                .then_some(Self::Tar),
        }
    }

    /// Its usual ending, without the dot.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::TarGz => "tar.gz",
            Self::TarZst => "tar.zst",
            Self::Zip => "zip",
            Self::Tar => "tar",
        }
    }

    /// Endings that people give it.
    #[must_use]
    pub const fn names(self) -> &'static [&'static str] {
        match self {
            Self::TarGz => &[".tar.gz", ".tgz"],
            Self::TarZst => &[".tar.zst", ".tzst"],
            Self::Zip => &[".zip"],
            Self::Tar => &[".tar"],
        }
    }
}

/// In the header of an archive's first entry, which begins with the entry's name. GNU's and POSIX' tar go on
/// differently after it.
const TAR_MAGIC: &[u8] = b"ustar";
const TAR_MAGIC_AT: usize = 257;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_their_first_bytes() {
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
    fn a_plain_tar_is_told_by_its_first_header() {
        for magic in [b"ustar  \0", b"ustar\x0000"] {
            let mut head = vec![0; 512];
            head[..13].copy_from_slice(b"manifest.json");
            head[257..265].copy_from_slice(magic);
            let detect = |bytes: usize| ArchiveFormat::detect(&head[..bytes]);
            assert_eq!(detect(512), Some(ArchiveFormat::Tar));
            assert_eq!(
                detect(ArchiveFormat::LONGEST_MAGIC),
                Some(ArchiveFormat::Tar)
            );
            assert_eq!(detect(ArchiveFormat::LONGEST_MAGIC - 1), None);
        }
        assert_eq!(ArchiveFormat::detect(&[0; 512]), None);
    }
}

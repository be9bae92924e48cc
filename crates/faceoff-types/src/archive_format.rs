/// The archives in which a bundle may come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArchiveFormat {
    /// `.tar.gz`
    TarGz,
    /// `.tar.zst`
    TarZst,
    /// `.zip`
    Zip,
}

impl ArchiveFormat {
    /// So many first bytes tell any of them.
    pub const LONGEST_MAGIC: usize = 4;

    /// Told by its first bytes, whatever its name says.
    #[must_use]
    pub const fn detect(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::TarGz),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::TarZst),
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            _ => None,
        }
    }

    /// Its usual ending, without the dot.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::TarGz => "tar.gz",
            Self::TarZst => "tar.zst",
            Self::Zip => "zip",
        }
    }

    /// Endings that people give it.
    #[must_use]
    pub const fn names(self) -> &'static [&'static str] {
        match self {
            Self::TarGz => &[".tar.gz", ".tgz"],
            Self::TarZst => &[".tar.zst", ".tzst"],
            Self::Zip => &[".zip"],
        }
    }
}

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
}

//! SHA-256 digests, by which a container image refers to its documents and layers (*blobs*).

use super::messages::invalid;
use crate::bundle::error::BundleError;
use sha2::{Digest as _, Sha256};
use std::io::{self, Read};

/// A SHA-256 digest, as hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Digest(String);

impl Digest {
    /// Parses `sha256:` and 64 digits.
    pub(super) fn parse(text: &str) -> Result<Self, BundleError> {
        let digits = text.strip_prefix("sha256:").unwrap_or_default();
        if is_hash(digits) {
            return Ok(Self(digits.to_owned()));
        }
        let shown: String = text.chars().take(100).collect();
        Err(invalid(format_args!(
            "names something by the digest {shown:?}: expected sha256: and 64 digits of 0-9a-f"
        )))
    }

    /// Path of the blob with this digest in an OCI layout.
    pub(super) fn blob_path(&self) -> String {
        format!("{BLOBS}{}", self.0)
    }

    /// The digest in the path of a blob; `None` for other paths.
    pub(super) fn from_blob_path(path: &str) -> Option<Self> {
        let digits = path.strip_prefix(BLOBS)?;
        is_hash(digits).then(|| Self(digits.to_owned()))
    }

    /// Checks that the read bytes have this digest.
    pub(super) fn check(&self, name: &str, found: Sha256) -> Result<(), BundleError> {
        let found = hex::encode(found.finalize());
        if found == self.0 {
            return Ok(());
        }
        Err(BundleError::Invalid(format!(
            "{name} differs from the image's digest: expected SHA-256 {}, found {found}",
            self.0
        )))
    }
}

/// Folder of the blobs in an OCI layout.
const BLOBS: &str = "blobs/sha256/";

fn is_hash(digits: &str) -> bool {
    digits.len() == 64
        && digits
            .bytes()
            .all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// A reader that hashes its bytes.
pub(super) struct HashingReader<R> {
    inner: R,
    hash: Sha256,
}

impl<R: Read> HashingReader<R> {
    pub(super) fn new(inner: R) -> Self {
        Self {
            inner,
            hash: Sha256::new(),
        }
    }

    /// The hash of all read bytes.
    pub(super) fn into_hash(self) -> Sha256 {
        self.hash
    }
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.hash.update(&buffer[..read]);
        Ok(read)
    }
}

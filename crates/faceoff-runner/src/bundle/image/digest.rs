use super::words::invalid;
use crate::bundle::error::BundleError;
use sha2::{Digest as _, Sha256};
use std::io::{self, Read};

/// What bytes must hash to, as hexadecimal digits of SHA-256.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Digest(String);

impl Digest {
    /// Of `sha256:` and 64 digits.
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

    /// Where an image's layout keeps the bytes of this digest.
    pub(super) fn blob(&self) -> String {
        format!("{BLOBS}{}", self.0)
    }

    /// The digest of the bytes that belong at a place of a layout; of other places nothing is said.
    pub(super) fn of_blob(place: &str) -> Option<Self> {
        let digits = place.strip_prefix(BLOBS)?;
        is_hash(digits).then(|| Self(digits.to_owned()))
    }

    /// What has been read must have this digest.
    pub(super) fn check(&self, what: &str, found: Sha256) -> Result<(), BundleError> {
        let found = hex::encode(found.finalize());
        if found == self.0 {
            return Ok(());
        }
        Err(BundleError::Invalid(format!(
            "{what} is not what the image says: expected SHA-256 {}, found {found}",
            self.0
        )))
    }
}

const BLOBS: &str = "blobs/sha256/";

fn is_hash(digits: &str) -> bool {
    digits.len() == 64
        && digits
            .bytes()
            .all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// A reader that hashes what is read through it.
pub(super) struct Hashed<R> {
    inner: R,
    hash: Sha256,
}

impl<R: Read> Hashed<R> {
    pub(super) fn new(inner: R) -> Self {
        Self {
            inner,
            hash: Sha256::new(),
        }
    }

    /// The hash of all that was read.
    pub(super) fn into_hash(self) -> Sha256 {
        self.hash
    }
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.hash.update(&buffer[..read]);
        Ok(read)
    }
}

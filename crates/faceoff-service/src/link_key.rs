//! The server's secret key for download links and grants. A *grant* gives a remote worker access to the files of its job.

use faceoff_wire::grant::GrantKey;
use std::fmt;

/// The secret key of the server. The signature of a download link is computed from this key and from the hash of the token with
/// which the link was created. The key is not in the database, so a copy of the database does not suffice to sign links. The
/// key that seals grants derives from it.
#[derive(Clone)]
pub struct LinkKey([u8; 32]);

impl LinkKey {
    /// A new random key.
    ///
    /// # Errors
    /// The operating system provides no randomness.
    pub fn generate() -> Result<Self, getrandom::Error> {
        let mut key = [0; 32];
        getrandom::fill(&mut key)?;
        Ok(Self(key))
    }

    /// Reads the format of [`to_hex`](Self::to_hex); `None` for anything else.
    #[must_use]
    pub fn from_hex(text: &str) -> Option<Self> {
        let mut key = [0; 32];
        hex::decode_to_slice(text, &mut key).ok()?;
        Some(Self(key))
    }

    /// The key as 64 hexadecimal digits; secret.
    #[must_use]
    pub fn to_hex(&self) -> String {
        hex::encode(self.0)
    }

    /// The key that seals grants of remote jobs.
    #[must_use]
    pub fn grant_key(&self) -> GrantKey {
        GrantKey::from_secret(&self.0)
    }

    pub const fn bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

impl fmt::Debug for LinkKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LinkKey(…)")
    }
}

//! What links and grants are signed with.

use faceoff_wire::grant::GrantKey;
use std::fmt;

/// What links of this server are signed with, beside their maker's token: whoever has a copy of the database alone can sign
/// none.
#[derive(Clone)]
pub struct LinkKey([u8; 32]);

impl LinkKey {
    /// A new one.
    ///
    /// # Errors
    /// If the operating system has no randomness.
    pub fn generate() -> Result<Self, getrandom::Error> {
        let mut key = [0; 32];
        getrandom::fill(&mut key)?;
        Ok(Self(key))
    }

    /// One that was kept as [`to_hex`](Self::to_hex); `None` of anything else.
    #[must_use]
    pub fn from_hex(text: &str) -> Option<Self> {
        let mut key = [0; 32];
        hex::decode_to_slice(text, &mut key).ok()?;
        Some(Self(key))
    }

    /// As 64 hexadecimal digits, to be kept secret.
    #[must_use]
    pub fn to_hex(&self) -> String {
        hex::encode(self.0)
    }

    /// What grants of work orders are sealed with.
    #[must_use]
    pub fn of_grants(&self) -> GrantKey {
        GrantKey::of(&self.0)
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

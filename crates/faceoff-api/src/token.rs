//! Secrets of API clients and users: tokens, session cookies and invitation codes.
//!
//! Each is 256 random bits behind a readable prefix. The server stores only the BLAKE3 hash. Trying out 2^256 values is impossible,
//! so a slow, salted hash, which passwords need, would only slow every request down.

use std::fmt;

/// What a secret is for. Its prefix shows it to leak scanners and to readers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SecretKind {
    /// A team's API token.
    Team,
    /// The API token of the server's operator, who holds the file `admin-token`.
    Operator,
    /// A user's API token.
    User,
    /// The session cookie of a signed-in browser.
    Session,
    /// The code of an invitation link.
    Invitation,
}

impl SecretKind {
    const fn prefix(self) -> &'static str {
        match self {
            Self::Team => "fo_team_",
            Self::Operator => "fo_admin_",
            Self::User => "fo_person_",
            Self::Session => "fo_session_",
            Self::Invitation => "fo_invite_",
        }
    }
}

/// A new secret in clear text, shown once.
pub struct Secret(String);

impl Secret {
    /// Draws a new secret from the operating system's random generator.
    ///
    /// # Errors
    /// The operating system provides no randomness.
    pub fn generate(kind: SecretKind) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(Self(format!("{}{}", kind.prefix(), hex::encode(bytes))))
    }

    /// The secret in clear text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The hash that the server stores.
    #[must_use]
    pub fn hash(&self) -> [u8; 32] {
        hash_token(&self.0)
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// BLAKE3 of a secret's text.
#[must_use]
pub fn hash_token(token: &str) -> [u8; 32] {
    *blake3::hash(token.as_bytes()).as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_unique_and_hidden_in_debug_output() {
        const HEX_DIGITS: usize = 64;
        let first = Secret::generate(SecretKind::Team).unwrap();
        let second = Secret::generate(SecretKind::Team).unwrap();
        assert_ne!(first.as_str(), second.as_str());
        assert_eq!(first.as_str().len(), "fo_team_".len() + HEX_DIGITS);
        assert!(first.as_str().starts_with("fo_team_"));
        assert!(!format!("{first:?}").contains(first.as_str()));
        assert_eq!(first.hash(), hash_token(first.as_str()));
        assert_ne!(first.hash(), second.hash());
    }
}

//! Tokens and codes.
//!
//! Each is 256 random bits behind a readable prefix. Only its BLAKE3 hash is kept: nobody can try
//! out 2^256 tokens, so the slow, salted hashes that protect guessable passwords would only make
//! every request slow.

use std::fmt;

/// What a secret is for; readable in its prefix, so that leak scanners and people can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SecretKind {
    /// A team's token.
    Team,
    /// The host's token.
    Admin,
    /// A person's token.
    Person,
    /// The cookie of whoever has signed in.
    Session,
    /// The code of a link by which somebody joins.
    Invitation,
}

impl SecretKind {
    const fn prefix(self) -> &'static str {
        match self {
            Self::Team => "fo_team_",
            Self::Admin => "fo_admin_",
            Self::Person => "fo_person_",
            Self::Session => "fo_session_",
            Self::Invitation => "fo_invite_",
        }
    }
}

/// A new token or code in the clear, to be handed out once.
pub struct Secret(String);

impl Secret {
    /// Draws a new token from the operating system's generator.
    ///
    /// # Errors
    /// The operating system has no randomness to give.
    pub fn generate(kind: SecretKind) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(Self(format!("{}{}", kind.prefix(), hex::encode(bytes))))
    }

    /// The token itself.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// What is stored.
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

/// BLAKE3 of a token's text.
#[must_use]
pub fn hash_token(token: &str) -> [u8; 32] {
    *blake3::hash(token.as_bytes()).as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_are_long_and_hide_in_debug_output() {
        let a = Secret::generate(SecretKind::Team).unwrap();
        let b = Secret::generate(SecretKind::Team).unwrap();
        assert_ne!(a.as_str(), b.as_str());
        assert_eq!(a.as_str().len(), "fo_team_".len() + 64);
        assert!(a.as_str().starts_with("fo_team_"));
        assert!(!format!("{a:?}").contains(a.as_str()));
        assert_eq!(a.hash(), hash_token(a.as_str()));
        assert_ne!(a.hash(), b.hash());
    }
}

//! Bearer tokens.
//!
//! A token is 256 random bits behind a readable prefix. Only its BLAKE3 hash is kept: nobody can try
//! out 2^256 tokens, so the slow, salted hashes that protect guessable passwords would only make
//! every request slow.

use std::fmt;
use subtle::ConstantTimeEq;

/// Whose token it is; readable in the token's prefix, so that leak scanners and people can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// A team's.
    Team,
    /// The organiser's.
    Admin,
}

impl TokenKind {
    const fn prefix(self) -> &'static str {
        match self {
            Self::Team => "fo_team_",
            Self::Admin => "fo_admin_",
        }
    }
}

/// A new token in the clear, to be handed out once.
pub struct Token(String);

impl Token {
    /// Draws a new token from the operating system's generator.
    ///
    /// # Errors
    /// The operating system has no randomness to give.
    pub fn generate(kind: TokenKind) -> Result<Self, getrandom::Error> {
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

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

/// BLAKE3 of a token's text.
#[must_use]
pub fn hash_token(token: &str) -> [u8; 32] {
    *blake3::hash(token.as_bytes()).as_bytes()
}

/// Compares two hashes in constant time.
pub(crate) fn same_hash(a: &[u8; 32], b: &[u8; 32]) -> bool {
    a.ct_eq(b).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_are_long_and_hide_in_debug_output() {
        let a = Token::generate(TokenKind::Team).unwrap();
        let b = Token::generate(TokenKind::Team).unwrap();
        assert_ne!(a.as_str(), b.as_str());
        assert_eq!(a.as_str().len(), "fo_team_".len() + 64);
        assert!(a.as_str().starts_with("fo_team_"));
        assert!(!format!("{a:?}").contains(a.as_str()));
        assert!(same_hash(&a.hash(), &hash_token(a.as_str())));
        assert!(!same_hash(&a.hash(), &b.hash()));
    }
}

//! The key of an upload that a client may send more than once (header `Idempotency-Key`).

use std::{fmt, str::FromStr};

const MAX_CHARS: usize = 100;

/// A text that a client has chosen for one upload: 1 to 100 visible ASCII characters. Of two uploads with the same key of the
/// same team, the second one creates nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdempotencyKey(String);

/// A text that cannot be an idempotency key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected 1 to {MAX_CHARS} visible ASCII characters, such as a UUID")]
pub struct InvalidIdempotencyKey;

impl IdempotencyKey {
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for IdempotencyKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for IdempotencyKey {
    type Err = InvalidIdempotencyKey;

    /// Accepts the key with and without the quotation marks of a structured header field.
    fn from_str(text: &str) -> Result<Self, InvalidIdempotencyKey> {
        let unquoted = text
            .strip_prefix('"')
            .and_then(|text| text.strip_suffix('"'));
        let key = unquoted.unwrap_or(text);
        let is_valid =
            (1..=MAX_CHARS).contains(&key.len()) && key.bytes().all(|byte| byte.is_ascii_graphic());
        is_valid
            .then(|| Self(key.to_owned()))
            .ok_or(InvalidIdempotencyKey)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idempotency_key_is_the_same_with_quotation_marks() {
        let key: IdempotencyKey = "7b9e".parse().unwrap();
        assert_eq!("\"7b9e\"".parse(), Ok(key.clone()));
        assert_eq!(key.to_string(), "7b9e");
    }

    #[test]
    fn invalid_idempotency_keys_are_refused() {
        for text in ["", "\"\"", "a b", "schlüssel", &"a".repeat(101)] {
            let parsed = text.parse::<IdempotencyKey>();
            assert_eq!(parsed, Err(InvalidIdempotencyKey), "{text:?}");
        }
    }
}

//! What the holder of a work order may read and write of the server's files: sealed by the server, so that it needs to remember
//! none, and nobody can make one. That the order is still its holder's is asked of the queue each time.

use crate::{game::GameSpec, work::ShardSpec};
use faceoff_types::BundleRef;
use serde::{Deserialize, Serialize};
use std::fmt;
use uuid::Uuid;

/// What an order opens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grant {
    /// The order's unit of work.
    pub unit: Uuid,
    /// That of the lease under which it was given out.
    pub nonce: Uuid,
    /// What may be fetched: the agents that play.
    pub bundles: Vec<BundleRef>,
    /// What may be stored.
    pub writes: Writes,
    /// What the recording must be of, if one is stored.
    pub plays: Plays,
    /// BLAKE3 of the program that gave the order out: what another has played says nothing of this one.
    #[serde(default)]
    pub program: String,
}

/// What is played under an order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Plays {
    /// Nothing that is recorded.
    Nothing,
    /// Episodes.
    Shard(ShardSpec),
    /// A game.
    Game(GameSpec),
}

/// What may be stored under an order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Writes {
    /// Nothing.
    Nothing,
    /// One file, of this key.
    File(String),
    /// The files of a recording, below this key prefix.
    Folder(String),
}

/// What a server seals its grants with.
#[derive(Clone)]
pub struct GrantKey([u8; 32]);

/// The longest name of a file of a recording.
const LONGEST_NAME: usize = 64;

impl GrantKey {
    /// Of a server that keeps this secret.
    #[must_use]
    pub fn of(secret: &[u8; 32]) -> Self {
        Self(blake3::derive_key("faceoff: grants of work orders", secret))
    }

    /// A number that nobody knows before who does not know the secret, the `number`th of a lease.
    #[must_use]
    pub fn draw(&self, nonce: Uuid, number: u32) -> u64 {
        let mut hasher = blake3::Hasher::new_keyed(&self.0);
        hasher.update(b"draw");
        hasher.update(nonce.as_bytes());
        hasher.update(&number.to_le_bytes());
        let mut bytes = [0; 8];
        hasher.finalize_xof().fill(&mut bytes);
        u64::from_le_bytes(bytes)
    }

    fn seal(&self, words: &[u8]) -> blake3::Hash {
        blake3::keyed_hash(&self.0, words)
    }
}

impl fmt::Debug for GrantKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("GrantKey(…)")
    }
}

impl Grant {
    /// As a header carries it.
    ///
    /// # Errors
    /// None that a grant could cause: all of it can be written.
    pub fn sealed(&self, key: &GrantKey) -> serde_json::Result<String> {
        let words = serde_json::to_vec(self)?;
        let seal = key.seal(&words);
        Ok(format!("{}.{}", hex::encode(words), seal.to_hex()))
    }

    /// `None` of anything that was not sealed with this key.
    #[must_use]
    pub fn open(text: &str, key: &GrantKey) -> Option<Self> {
        let (words, seal) = text.split_once('.')?;
        let words = hex::decode(words).ok()?;
        // Hashes are compared in constant time.
        if blake3::Hash::from_hex(seal).ok()? != key.seal(&words) {
            return None;
        }
        serde_json::from_slice(&words).ok()
    }

    /// How many episodes are recorded under it.
    #[must_use]
    pub fn episodes(&self) -> u32 {
        match &self.plays {
            Plays::Shard(spec) => spec.episodes.end.saturating_sub(spec.episodes.start),
            Plays::Game(_) | Plays::Nothing => 0,
        }
    }

    /// The bundle of this hash (BLAKE3, 64 hexadecimal digits), if it may be fetched.
    #[must_use]
    pub fn bundle(&self, blake3: &str) -> Option<&BundleRef> {
        self.bundles.iter().find(|bundle| bundle.blake3 == blake3)
    }

    /// The key under which a file of this name may be stored.
    #[must_use]
    pub fn key_of(&self, name: &str) -> Option<String> {
        match &self.writes {
            Writes::Nothing => None,
            Writes::File(key) => Some(key.clone()),
            Writes::Folder(prefix) => is_name(name).then(|| format!("{prefix}/{name}")),
        }
    }
}

/// Names of files as recordings have them: no way out of their folder.
fn is_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    (1..=LONGEST_NAME).contains(&name.len()) && !name.starts_with('.') && name.chars().all(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grant() -> Grant {
        Grant {
            unit: Uuid::from_u128(1),
            nonce: Uuid::from_u128(2),
            bundles: vec![BundleRef {
                key: "bundles/a/b.zip".into(),
                bytes: 7,
                blake3: "ab".repeat(32),
                file_name: "agent.zip".into(),
            }],
            writes: Writes::Folder("runs/r/n".into()),
            plays: Plays::Nothing,
            program: "cd".repeat(32),
        }
    }

    #[test]
    fn what_was_sealed_opens_and_nothing_else() {
        let (key, other) = (GrantKey::of(&[1; 32]), GrantKey::of(&[2; 32]));
        let sealed = grant().sealed(&key).unwrap();
        assert_eq!(Grant::open(&sealed, &key), Some(grant()));
        assert_eq!(Grant::open(&sealed, &other), None);
        let (words, seal) = sealed.split_once('.').unwrap();
        let wider = Grant {
            writes: Writes::Folder("runs/another".into()),
            ..grant()
        };
        let wider = hex::encode(serde_json::to_vec(&wider).unwrap());
        for forged in [
            format!("{wider}.{seal}"),
            format!("{words}."),
            words.to_owned(),
            String::new(),
        ] {
            assert_eq!(Grant::open(&forged, &key), None, "{forged}");
        }
    }

    #[test]
    fn it_names_what_may_be_read_and_written() {
        let grant = grant();
        assert!(grant.bundle(&"ab".repeat(32)).is_some());
        assert!(grant.bundle(&"cd".repeat(32)).is_none());
        assert_eq!(
            grant.key_of("steps.parquet").as_deref(),
            Some("runs/r/n/steps.parquet")
        );
        for name in [
            "",
            ".",
            "..",
            "../x",
            "a/b",
            "a\\b",
            ".hidden",
            "a b",
            &"n".repeat(65),
        ] {
            assert_eq!(grant.key_of(name), None, "{name:?}");
        }
        let file = Grant {
            writes: Writes::File("ablations/x".into()),
            ..grant.clone()
        };
        assert_eq!(file.key_of("clips").as_deref(), Some("ablations/x"));
        let nothing = Grant {
            writes: Writes::Nothing,
            ..grant
        };
        assert_eq!(nothing.key_of("clips"), None);
    }

    proptest! {
        #[test]
        fn no_text_of_strangers_opens(text in ".{0,200}") {
            prop_assert_eq!(Grant::open(&text, &GrantKey::of(&[3; 32])), None);
        }
    }
}

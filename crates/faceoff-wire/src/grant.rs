//! Grants: signed tickets, like presigned URLs, that name the server's files which a remote worker may read and write for one job. A
//! *lease* is the right to run a job for a limited time.
//!
//! The server seals a grant with a secret key, so it can check grants without storing them, and they cannot be
//! forged. On each use it also asks the queue whether the lease is still valid.

use crate::{game::GameSpec, job::ShardSpec};
use faceoff_types::BundleRef;
use serde::{Deserialize, Serialize};
use std::fmt;
use uuid::Uuid;

/// A grant: the file access of a worker, as long as it has one lease of one job. The server issues it with the job, and the worker sends
/// it with each request for a file and with the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grant {
    /// Id of the job in the queue.
    #[serde(rename = "unit")]
    pub job_id: Uuid,
    /// Nonce (random id) of the lease for which the grant was issued.
    pub nonce: Uuid,
    /// Bundles that may be fetched: those of the job's agents.
    pub bundles: Vec<BundleRef>,
    /// Files that may be stored.
    #[serde(rename = "writes")]
    pub write_scope: WriteScope,
    /// Specification that a stored recording must match.
    #[serde(rename = "plays")]
    pub expected_recording: ExpectedRecording,
    /// BLAKE3 of the executable of the server that issued the job, 64 hexadecimal digits. A result from another executable is not
    /// comparable, so the job is run again.
    #[serde(default, rename = "program")]
    pub program_blake3: String,
}

/// The recording that a job is expected to store.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExpectedRecording {
    /// No recording.
    #[serde(rename = "nothing")]
    None,
    /// Episodes of a shard.
    Shard(ShardSpec),
    /// A game.
    Game(GameSpec),
}

/// The storage keys that a job may write.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WriteScope {
    /// No file.
    #[serde(rename = "nothing")]
    None,
    /// One file with this key.
    File(String),
    /// The files of a recording under this key prefix.
    Folder(String),
}

/// The key with which a server seals its grants.
#[derive(Clone)]
pub struct GrantKey([u8; 32]);

/// Longest file name in a recording, in bytes.
const MAX_FILE_NAME_BYTES: usize = 64;

impl GrantKey {
    /// Derives the key from the server's secret.
    #[must_use]
    pub fn from_secret(secret: &[u8; 32]) -> Self {
        // The context text is part of the key, so it cannot change.
        Self(blake3::derive_key("faceoff: grants of work orders", secret))
    }

    /// The `number`th pseudo-random number of the lease with this nonce. Workers cannot predict it without the secret, so the server
    /// chooses with it which episodes of a result it simulates again.
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

    /// The keyed hash (message authentication code) of `bytes`.
    fn mac(&self, bytes: &[u8]) -> blake3::Hash {
        blake3::keyed_hash(&self.0, bytes)
    }
}

impl fmt::Debug for GrantKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("GrantKey(…)")
    }
}

impl Grant {
    /// The text for an HTTP header: JSON in hexadecimal digits, a dot and the keyed hash.
    ///
    /// # Errors
    /// Only if serialisation fails, which no grant causes.
    pub fn seal(&self, key: &GrantKey) -> serde_json::Result<String> {
        let json = serde_json::to_vec(self)?;
        let seal = key.mac(&json);
        Ok(format!("{}.{}", hex::encode(json), seal.to_hex()))
    }

    /// Reads a sealed grant; `None` if the text was not sealed with this key.
    #[must_use]
    pub fn open(text: &str, key: &GrantKey) -> Option<Self> {
        let (json, seal) = text.split_once('.')?;
        let json = hex::decode(json).ok()?;
        // Hashes are compared in constant time.
        if blake3::Hash::from_hex(seal).ok()? != key.mac(&json) {
            return None;
        }
        serde_json::from_slice(&json).ok()
    }

    /// Number of episodes in the expected recording.
    #[must_use]
    pub fn episodes(&self) -> u32 {
        match &self.expected_recording {
            ExpectedRecording::Shard(spec) => spec.episodes.end.saturating_sub(spec.episodes.start),
            ExpectedRecording::Game(_) | ExpectedRecording::None => 0,
        }
    }

    /// The bundle with this hash (BLAKE3, 64 hexadecimal digits), if it may be fetched.
    #[must_use]
    pub fn bundle(&self, blake3: &str) -> Option<&BundleRef> {
        self.bundles.iter().find(|bundle| bundle.blake3 == blake3)
    }

    /// The storage key for a file of this name; `None` if it may not be stored.
    #[must_use]
    pub fn storage_key(&self, name: &str) -> Option<String> {
        match &self.write_scope {
            WriteScope::None => None,
            WriteScope::File(key) => Some(key.clone()),
            WriteScope::Folder(prefix) => is_file_name(name).then(|| format!("{prefix}/{name}")),
        }
    }
}

/// Is this a valid file name in a recording? Names that could leave its folder are not.
fn is_file_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    (1..=MAX_FILE_NAME_BYTES).contains(&name.len())
        && !name.starts_with('.')
        && name.chars().all(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BUNDLE_BLAKE3: &str = "abababababababababababababababababababababababababababababababab";
    const OTHER_BLAKE3: &str = "cdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcdcd";

    fn grant() -> Grant {
        Grant {
            job_id: Uuid::from_u128(1),
            nonce: Uuid::from_u128(2),
            bundles: vec![BundleRef {
                key: "bundles/a/b.zip".into(),
                bytes: 7,
                blake3: BUNDLE_BLAKE3.into(),
                file_name: "agent.zip".into(),
            }],
            write_scope: WriteScope::Folder("runs/r/n".into()),
            expected_recording: ExpectedRecording::None,
            program_blake3: OTHER_BLAKE3.into(),
        }
    }

    #[test]
    fn sealed_grant_opens_and_forgeries_do_not() {
        let (key, other_key) = (
            GrantKey::from_secret(&[1; 32]),
            GrantKey::from_secret(&[2; 32]),
        );
        let sealed = grant().seal(&key).unwrap();
        assert_eq!(Grant::open(&sealed, &key), Some(grant()));
        assert_eq!(Grant::open(&sealed, &other_key), None);
        let (json, seal) = sealed.split_once('.').unwrap();
        let wider_grant = Grant {
            write_scope: WriteScope::Folder("runs/another".into()),
            ..grant()
        };
        let wider_json = hex::encode(serde_json::to_vec(&wider_grant).unwrap());
        for forged in [
            format!("{wider_json}.{seal}"),
            format!("{json}."),
            json.to_owned(),
            String::new(),
        ] {
            assert_eq!(Grant::open(&forged, &key), None, "{forged}");
        }
    }

    #[test]
    fn grant_limits_reads_and_writes() {
        let grant = grant();
        assert!(grant.bundle(BUNDLE_BLAKE3).is_some());
        assert!(grant.bundle(OTHER_BLAKE3).is_none());
        assert_eq!(
            grant.storage_key("steps.parquet").as_deref(),
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
            &"n".repeat(MAX_FILE_NAME_BYTES + 1),
        ] {
            assert_eq!(grant.storage_key(name), None, "{name:?}");
        }
        let file = Grant {
            write_scope: WriteScope::File("ablations/x".into()),
            ..grant.clone()
        };
        assert_eq!(file.storage_key("clips").as_deref(), Some("ablations/x"));
        let no_file = Grant {
            write_scope: WriteScope::None,
            ..grant
        };
        assert_eq!(no_file.storage_key("clips"), None);
    }

    proptest! {
        #[test]
        fn arbitrary_text_opens_no_grant(text in ".{0,200}") {
            prop_assert_eq!(Grant::open(&text, &GrantKey::from_secret(&[3; 32])), None);
        }
    }
}

//! Names of remote workers, which are processes on other machines that run jobs.

use std::{fmt, str::FromStr};

/// Maximum length of a worker's name.
const MAX_NAME_LEN: usize = 64;

/// Name of a remote worker: 1 to 64 of a-z, A-Z, 0-9, - and _, so that it can be a token of a NATS subject.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct WorkerName(String);

/// A text that is not a [`WorkerName`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected a worker's name: 1 to {MAX_NAME_LEN} of a-z, A-Z, 0-9, - and _")]
pub struct ParseWorkerNameError;

impl WorkerName {
    /// Prefix of the lease holders of all remote workers: leases name a slot as its holder, such as `remote/rack-1/slot-0`. The
    /// holders of the server's own slots are `slot-0` and so on.
    pub const REMOTE: &str = "remote";

    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The remote worker of a lease holder; `None` if the holder is not the slot of a remote worker.
    #[must_use]
    pub fn from_holder(holder: &str) -> Option<Self> {
        let (worker, _) = holder
            .strip_prefix(Self::REMOTE)?
            .strip_prefix('/')?
            .split_once('/')?;
        worker.parse().ok()
    }

    /// The worker's part of its lease holders: `remote/rack-1`.
    #[must_use]
    pub fn holder(&self) -> String {
        format!("{}/{}", Self::REMOTE, self.0)
    }

    /// A slot of the worker as a lease holder: `remote/rack-1/slot-0`. With an empty `slot`, the prefix of all its slots.
    #[must_use]
    pub fn slot_holder(&self, slot: &str) -> String {
        format!("{}/{slot}", self.holder())
    }
}

impl fmt::Display for WorkerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for WorkerName {
    type Err = ParseWorkerNameError;

    fn from_str(text: &str) -> Result<Self, ParseWorkerNameError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let is_name = (1..=MAX_NAME_LEN).contains(&text.len()) && text.chars().all(allowed);
        is_name
            .then(|| Self(text.to_owned()))
            .ok_or(ParseWorkerNameError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worker_names_are_valid_subject_tokens() {
        for name in ["", "a.b", "a b", "*", ">", "a/b", &"x".repeat(65)] {
            let error = name.parse::<WorkerName>().unwrap_err();
            assert!(error.to_string().contains("1 to 64"), "{name:?}");
        }
    }

    #[test]
    fn lease_holder_names_the_worker_of_a_slot() {
        let worker: WorkerName = "rack-1_b".parse().unwrap();
        assert_eq!(worker.holder(), "remote/rack-1_b");
        let slot = worker.slot_holder("slot-0");
        assert_eq!(slot, "remote/rack-1_b/slot-0");
        assert_eq!(WorkerName::from_holder(&slot), Some(worker));
        for other in [
            "slot-0",
            "remote/rack-1",
            "remote-1/rack-1/slot-0",
            "remote//slot-0",
        ] {
            assert_eq!(WorkerName::from_holder(other), None, "{other}");
        }
    }
}

//! Checks of results that the server began and did not finish. A result whose check ends the process, or panics, would be
//! delivered and checked again and again; so the number of such checks is kept in a file per result.

use anyhow::Context as _;
use std::{fs, io, path::PathBuf};
use uuid::Uuid;

/// A result is not checked again after this number of unfinished checks.
const MAX_UNFINISHED: u32 = 3;

/// Unfinished checks, by the nonces of their leases.
#[derive(Debug)]
pub(super) struct UnfinishedChecks {
    folder: PathBuf,
}

/// Whether a check of a result may begin.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum CheckStart {
    Begun,
    /// Too many earlier ones are unfinished.
    Refused,
}

impl UnfinishedChecks {
    /// Keeps its files in this folder, which is created if necessary.
    pub(super) fn open(folder: PathBuf) -> anyhow::Result<Self> {
        fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
        Ok(Self { folder })
    }

    /// The number of unfinished checks. An unreadable number counts as none.
    fn unfinished(&self, nonce: Uuid) -> io::Result<u32> {
        match fs::read_to_string(self.file(nonce)) {
            Ok(text) => Ok(text.parse().unwrap_or(0)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(0),
            Err(error) => Err(error),
        }
    }

    /// Records the beginning of a check, or refuses it.
    pub(super) fn begin(&self, nonce: Uuid) -> io::Result<CheckStart> {
        let unfinished = self.unfinished(nonce)?;
        if unfinished >= MAX_UNFINISHED {
            return Ok(CheckStart::Refused);
        }
        fs::write(self.file(nonce), (unfinished + 1).to_string())?;
        Ok(CheckStart::Begun)
    }

    /// Records that a check of the result has ended, or that none is needed any more.
    pub(super) fn finish(&self, nonce: Uuid) {
        let file = self.file(nonce);
        match fs::remove_file(&file) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => {
                tracing::warn!(file = %file.display(), %error, "a file could not be removed");
            }
        }
    }

    fn file(&self, nonce: Uuid) -> PathBuf {
        self.folder.join(nonce.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn result_is_refused_after_three_unfinished_checks() {
        let folder = tempfile::tempdir().unwrap();
        let nonce = Uuid::from_u128(1);
        // A new process each time.
        let open = || UnfinishedChecks::open(folder.path().join("checks")).unwrap();
        for _ in 0..3 {
            assert_eq!(open().begin(nonce).unwrap(), CheckStart::Begun);
        }
        assert_eq!(open().begin(nonce).unwrap(), CheckStart::Refused);
        assert_eq!(
            open().begin(Uuid::from_u128(2)).unwrap(),
            CheckStart::Begun,
            "another result"
        );
        let checks = open();
        checks.finish(nonce);
        checks.finish(nonce);
        for _ in 0..10 {
            assert_eq!(checks.begin(nonce).unwrap(), CheckStart::Begun);
            checks.finish(nonce);
        }
    }
}

//! A full disk is nobody's failure: what it interrupts is done again, and meanwhile nothing is begun.

use faceoff_runner::{PlatformFault, bundle::BundleError};
use faceoff_store::{Store, StoreError};
use faceoff_types::tells_of_full_disk;
use jiff::Timestamp;
use std::sync::Arc;
use tokio::sync::Mutex;

/// Does the error, or one that caused it, tell of a full disk?
pub(crate) fn is_told_by(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        tells_of_full_disk(cause)
            || matches!(cause.downcast_ref(), Some(StoreError::FullDisk(_)))
            || matches!(cause.downcast_ref(), Some(PlatformFault::FullDisk(_)))
            || matches!(cause.downcast_ref(), Some(BundleError::Io(error)) if tells_of_full_disk(error))
    })
}

/// While there is too little room nothing is claimed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pause {
    held: Arc<Mutex<bool>>,
}

impl Pause {
    /// Is nothing to be claimed now? At its end every lease gets a new time before the first claim: those
    /// that ran out did so because no renewal could be written, and their slots are at work.
    pub(crate) async fn holds(
        &self,
        store: &Store,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool, StoreError> {
        let mut held = self.held.lock().await;
        if store.room().is_short() {
            *held = true;
        } else if *held {
            store.renew_all_leases(lease_s, now).await?;
            *held = false;
        }
        Ok(*held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;
    use std::io::{self, ErrorKind};

    fn full() -> io::Error {
        ErrorKind::StorageFull.into()
    }

    #[test]
    fn a_full_disk_is_seen_in_what_the_parts_of_a_unit_fail_with() {
        let failed = [
            anyhow::Error::from(StoreError::FullDisk("the queue".into())),
            PlatformFault::FullDisk("steps.parquet".into()).into(),
            BundleError::Io(full()).into(),
            PlatformFault::Io {
                what: "recording".into(),
                source: full(),
            }
            .into(),
            full().into(),
        ];
        for error in failed {
            let error = Err::<(), _>(error).context("doing this").unwrap_err();
            assert!(is_told_by(&error), "{error:#}");
        }
        let damaged = BundleError::Io(ErrorKind::InvalidData.into());
        assert!(!is_told_by(&damaged.into()));
        assert!(!is_told_by(&PlatformFault::Cancelled.into()));
    }
}

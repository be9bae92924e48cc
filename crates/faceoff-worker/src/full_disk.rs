//! Handling of full disks. A job that a full disk interrupts is repeated, and the attempt does not count. While free space is short, the
//! slots of the server's process claim no job.

use faceoff_runner::{PlatformFault, bundle::BundleError};
use faceoff_store::{Store, StoreError};
use faceoff_types::is_full_disk;
use jiff::Timestamp;
use std::sync::Arc;
use tokio::sync::Mutex;

/// Is a full disk the cause of this error?
pub(crate) fn is_cause_of(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        is_full_disk(cause)
            || matches!(cause.downcast_ref(), Some(StoreError::DiskFull(_)))
            || matches!(cause.downcast_ref(), Some(PlatformFault::FullDisk(_)))
            || matches!(cause.downcast_ref(), Some(BundleError::Io(error)) if is_full_disk(error))
    })
}

/// Stops claiming jobs while there is too little free disk space.
#[derive(Debug, Clone, Default)]
pub(crate) struct ClaimPause {
    is_active: Arc<Mutex<bool>>,
}

impl ClaimPause {
    /// Is claiming paused now? When the pause ends, all leases are renewed before the next claim: renewals could not be
    /// written, so leases of running jobs may have expired.
    pub(crate) async fn is_active(
        &self,
        store: &Store,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool, StoreError> {
        let mut is_active = self.is_active.lock().await;
        if store.free_space().is_short() {
            *is_active = true;
        } else if *is_active {
            store.renew_all_leases(lease_s, now).await?;
            *is_active = false;
        }
        Ok(*is_active)
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
    fn full_disk_is_recognised_in_all_job_errors() {
        let errors = [
            anyhow::Error::from(StoreError::DiskFull("the queue".into())),
            PlatformFault::FullDisk("steps.parquet".into()).into(),
            BundleError::Io(full()).into(),
            PlatformFault::Io {
                action: "recording".into(),
                source: full(),
            }
            .into(),
            full().into(),
        ];
        for error in errors {
            let error = Err::<(), _>(error).context("running a job").unwrap_err();
            assert!(is_cause_of(&error), "{error:#}");
        }
        let damaged = BundleError::Io(ErrorKind::InvalidData.into());
        assert!(!is_cause_of(&damaged.into()));
        assert!(!is_cause_of(&PlatformFault::Cancelled.into()));
    }
}

//! Locks of partial uploads. A *partial upload* is a bundle that a team sends in several requests. Only one connection may write to its
//! file. A newer connection takes the file over, because the server may not know yet that an older one is broken.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;

/// The partial uploads that are being received, by file name.
#[derive(Debug, Default)]
pub struct PartialUploads {
    receivers: Mutex<HashMap<String, Receiver>>,
}

/// The connections that send parts of one partial upload.
#[derive(Debug)]
struct Receiver {
    /// Locked by the connection that may write to the file.
    file_lock: Arc<tokio::sync::Mutex<()>>,
    /// Ends the newest connection.
    cancel_newest: CancellationToken,
    /// Connections that write or wait.
    connections: usize,
}

/// The partial uploads in use; no other one is taken over while this lives.
pub(crate) struct InUse<'a>(MutexGuard<'a, HashMap<String, Receiver>>);

impl InUse<'_> {
    pub(crate) fn contains(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }
}

/// The right to write to the file of a partial upload, until this is dropped.
#[derive(Debug)]
pub struct PartialUploadLock {
    uploads: Arc<PartialUploads>,
    name: String,
    /// Cancelled once a newer connection wants the file.
    pub taken_over: CancellationToken,
    /// `None` while an older connection still has the file.
    guard: Option<OwnedMutexGuard<()>>,
}

impl PartialUploads {
    /// Ends the connection that receives this partial upload, if there is one, and waits until its bytes are written.
    pub async fn take_over(self: &Arc<Self>, name: &str) -> PartialUploadLock {
        let taken_over = CancellationToken::new();
        let file_lock = {
            let mut receivers = self.receivers();
            let receiver = receivers
                .entry(name.to_owned())
                .or_insert_with(|| Receiver {
                    file_lock: Arc::default(),
                    cancel_newest: CancellationToken::new(),
                    connections: 0,
                });
            receiver.cancel_newest.cancel();
            receiver.cancel_newest = taken_over.clone();
            receiver.connections += 1;
            Arc::clone(&receiver.file_lock)
        };
        // Made before the wait, so that a dropped wait is counted, too.
        let mut lock = PartialUploadLock {
            uploads: Arc::clone(self),
            name: name.to_owned(),
            taken_over,
            guard: None,
        };
        lock.guard = Some(file_lock.lock_owned().await);
        lock
    }

    /// Locks the list of partial uploads that are being received or read.
    pub(crate) fn in_use(&self) -> InUse<'_> {
        InUse(self.receivers())
    }

    /// The receivers; a panic of another thread cannot leave one half-written.
    fn receivers(&self) -> MutexGuard<'_, HashMap<String, Receiver>> {
        self.receivers
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for PartialUploadLock {
    fn drop(&mut self) {
        self.guard = None;
        let mut receivers = self.uploads.receivers();
        if let Some(receiver) = receivers.get_mut(&self.name) {
            receiver.connections -= 1;
            if receiver.connections == 0 {
                receivers.remove(&self.name);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn newer_connection_takes_a_partial_upload_over() {
        let uploads = Arc::new(PartialUploads::default());
        let first = uploads.take_over("a").await;
        let other = uploads.take_over("b").await;
        let second = tokio::spawn({
            let uploads = Arc::clone(&uploads);
            async move { uploads.take_over("a").await }
        });
        first.taken_over.cancelled().await;
        assert!(
            !second.is_finished(),
            "the older connection has the file until it ends"
        );
        assert!(!other.taken_over.is_cancelled());
        drop(first);
        let second = second.await.unwrap();
        assert!(!second.taken_over.is_cancelled());
        drop((second, other));
        assert!(uploads.receivers().is_empty(), "ended uploads are removed");
    }
}

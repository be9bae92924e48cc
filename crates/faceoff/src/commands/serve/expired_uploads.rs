//! Removes partial uploads that no client continues, so that they do not occupy the disk.

use faceoff_http::remove_expired_uploads;
use faceoff_types::Clock;
use std::{path::PathBuf, time::Duration};
use tokio_util::sync::CancellationToken;

/// Pause between two runs; a partial upload expires after a day.
const INTERVAL: Duration = Duration::from_mins(10);

/// Removes expired uploads now and from time to time, until the shutdown.
pub(super) async fn remove(
    upload_dir: PathBuf,
    clock: Clock,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    while !shutdown.is_cancelled() {
        if let Err(problem) = remove_expired_uploads(&upload_dir, clock.now()).await {
            tracing::warn!(
                problem = problem.detail(),
                "expired uploads could not be removed"
            );
        }
        tokio::select! {
            () = shutdown.cancelled() => {}
            () = tokio::time::sleep(INTERVAL) => {}
        }
    }
    Ok(())
}

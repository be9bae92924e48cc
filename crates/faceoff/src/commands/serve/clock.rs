//! The server's clock. It follows the system clock as long as that advances like Linux' monotonic clock, which cannot be set. If the
//! system clock is set (a *step*), the server's time continues by the monotonic clock. This lasts until the system clock is right again
//! or an organiser accepts the step.
//!
//! A file in the data folder records the time at which the monotonic clock was zero. So the server also
//! notices a step that happened while it did not run, unless the machine was restarted.

use anyhow::Context;
use faceoff_store::Store;
use faceoff_types::{Clock, ClockStart, ClockStep};
use jiff::{SignedDuration, Timestamp};
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};
use tokio_util::sync::CancellationToken;

/// How often the clocks are compared without another reason to read them.
const INTERVAL: Duration = Duration::from_secs(1);

/// Smaller changes of the zero time are not recorded again, and smaller changes of a clock step are not logged again.
const MIN_CHANGE: SignedDuration = SignedDuration::from_secs(1);

const FILE: &str = "clock.json";

/// Content of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ClockRecord {
    /// Linux' id of this start of the machine.
    boot_id: String,
    /// The server's time at the zero of the monotonic clock.
    zero_at: Timestamp,
}

/// The clock of a server with this data folder. It is also compared with the time of the newest event in the database: a clock that
/// is behind that is wrong.
///
/// # Errors
/// If the database cannot be read.
pub(super) async fn server_clock(data_dir: &Path, store: &Store) -> anyhow::Result<Clock> {
    let newest = store.newest_event_at().await;
    let start = ClockStart {
        zero_at: recorded_zero(data_dir),
        newest_change_at: newest.context("reading the newest change")?,
    };
    Ok(Clock::steady(Timestamp::now, since_boot, start))
}

/// Linux' monotonic clock that also runs while the machine is suspended.
fn since_boot() -> SignedDuration {
    let since_boot = clock_gettime(ClockId::Boottime);
    let nanoseconds = i32::try_from(since_boot.tv_nsec).unwrap_or_default();
    SignedDuration::new(since_boot.tv_sec, nanoseconds)
}

fn boot_id() -> Option<String> {
    let id = fs::read_to_string("/proc/sys/kernel/random/boot_id").ok()?;
    Some(id.trim().to_owned())
}

/// The recorded zero of the monotonic clock, if the record is of this boot.
fn recorded_zero(data_dir: &Path) -> Option<Timestamp> {
    let text = fs::read(data_dir.join(FILE)).ok()?;
    match serde_json::from_slice::<ClockRecord>(&text) {
        Ok(record) => (Some(record.boot_id) == boot_id()).then_some(record.zero_at),
        Err(error) => {
            tracing::warn!(%error, "the record of the clock is damaged and ignored: {FILE} in the data folder");
            None
        }
    }
}

/// Logs steps of the system clock and records the zero of the monotonic clock, until `shutdown`.
pub(super) async fn watch(
    clock: Clock,
    data_dir: PathBuf,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let boot_id = boot_id();
    let (mut logged, mut recorded) = (None, None);
    let mut has_failed = false;
    loop {
        logged = log_change(logged, clock.step());
        if let (Some(boot_id), Some(zero_at)) = (&boot_id, clock.zero_at())
            && recorded.is_none_or(|at| zero_at.duration_since(at).abs() > MIN_CHANGE)
        {
            let boot_id = boot_id.clone();
            match record(&data_dir, &ClockRecord { boot_id, zero_at }) {
                Ok(()) => (recorded, has_failed) = (Some(zero_at), false),
                Err(error) if !has_failed => {
                    has_failed = true;
                    tracing::warn!(%error, "the clock could not be recorded, trying again: if the server is restarted before, a step of the clock meanwhile is not noticed");
                }
                Err(_) => {}
            }
        }
        tokio::select! {
            () = shutdown.cancelled() => return Ok(()),
            () = tokio::time::sleep(INTERVAL) => {}
        }
    }
}

fn record(data_dir: &Path, record: &ClockRecord) -> std::io::Result<()> {
    let (path, new) = (data_dir.join(FILE), data_dir.join("clock.json.new"));
    fs::write(&new, serde_json::to_vec(record)?)?;
    fs::rename(new, path)
}

/// Logs a step that differs from the logged one, and its end. Returns the step that is logged now.
fn log_change(logged: Option<ClockStep>, step: Option<ClockStep>) -> Option<ClockStep> {
    match (logged, step) {
        (Some(logged), Some(step)) if (logged.by - step.by).abs() <= MIN_CHANGE => Some(logged),
        (_, Some(step)) => {
            tracing::error!("{step}. Set the clock, or accept it: faceoff admin accept-clock");
            Some(step)
        }
        (Some(_), None) => {
            tracing::info!("the system clock and the server's time agree again");
            None
        }
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_is_valid_for_one_boot() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        assert_eq!(recorded_zero(folder), None);
        let zero_at: Timestamp = "2026-03-01T10:00:00.123456789Z".parse().unwrap();
        let this_boot = ClockRecord {
            boot_id: boot_id().unwrap(),
            zero_at,
        };
        record(folder, &this_boot).unwrap();
        assert_eq!(recorded_zero(folder), Some(zero_at));
        let other_boot = ClockRecord {
            boot_id: "another".to_owned(),
            zero_at,
        };
        record(folder, &other_boot).unwrap();
        assert_eq!(recorded_zero(folder), None);
        fs::write(folder.join(FILE), "{").unwrap();
        assert_eq!(recorded_zero(folder), None);
    }

    #[test]
    fn monotonic_clock_counts_from_the_boot() {
        let (first, second) = (since_boot(), since_boot());
        assert!(first.is_positive() && first <= second);
    }
}

//! Checks of the clock and the time zone that determine *cutoffs*, the times at which evaluation days start.

use super::check::Check;
use faceoff_types::IanaTimeZone;
use jiff::{SignedDuration, Timestamp};
use std::{
    path::Path,
    process::{Command, Stdio},
};

/// How far a file's time may be ahead of the clock, since file systems round times.
const FILE_TIME_TOLERANCE: SignedDuration = SignedDuration::from_secs(5);

/// Checks whether the clock is synchronised and not behind the last change of the database.
pub fn clock(data_dir: &Path, now: Timestamp) -> Check {
    let newest = ["faceoff.sqlite3", "faceoff.sqlite3-wal"]
        .iter()
        .filter_map(|name| data_dir.join(name).metadata().ok()?.modified().ok())
        .max();
    if let Some(newest) = newest.and_then(|modified| Timestamp::try_from(modified).ok())
        && newest.duration_since(now) > FILE_TIME_TOLERANCE
    {
        return Check {
            name: "clock",
            found: format!("{now:.0} is before the last change of the database, {newest:.0}"),
            fix: Some(
                "set the clock: until it has caught up, evaluation days start at the wrong time or not at all".to_owned(),
            ),
        };
    }
    clock_check(now, is_synchronised())
}

fn clock_check(now: Timestamp, synchronised: Option<bool>) -> Check {
    let (found, fix) = match synchronised {
        Some(true) => ("synchronised with network time", None),
        Some(false) => (
            "not synchronised with network time",
            Some("timedatectl set-ntp true, or chrony: cutoffs follow this clock"),
        ),
        None => ("synchronisation unknown", None),
    };
    Check {
        name: "clock",
        found: format!("{now:.0}, {found}"),
        fix: fix.map(str::to_owned),
    }
}

/// The state that systemd reports; `None` without systemd.
fn is_synchronised() -> Option<bool> {
    let output = Command::new("timedatectl")
        .args(["show", "--property=NTPSynchronized", "--value"])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    match String::from_utf8_lossy(&output.stdout).trim() {
        "yes" => Some(true),
        "no" => Some(false),
        _ => None,
    }
}

/// Reports the time zone of a new season's evaluation days.
pub fn zone(zone: &IanaTimeZone, now: Timestamp) -> Check {
    let local = now.to_zoned(zone.time_zone());
    Check {
        name: "time zone",
        found: format!(
            "evaluation.zone is {zone}, local time {}",
            local.strftime("%Y-%m-%d %H:%M:%S (UTC%:z)")
        ),
        fix: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn clock_behind_the_database_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let now = Timestamp::now();
        assert_eq!(clock(folder.path(), now).name, "clock");
        fs::write(folder.path().join("faceoff.sqlite3"), "").unwrap();
        let hour = SignedDuration::from_hours(1);
        let behind = clock(folder.path(), now - hour);
        assert!(
            behind.found.contains("before the last change"),
            "{behind:?}"
        );
        assert!(behind.fix.is_some());
        assert!(!clock(folder.path(), now + hour).found.contains("before"));
    }

    #[test]
    fn unsynchronised_clock_has_a_fix() {
        let now = Timestamp::UNIX_EPOCH;
        assert!(
            clock_check(now, Some(false))
                .fix
                .unwrap()
                .contains("set-ntp")
        );
        assert_eq!(clock_check(now, Some(true)).fix, None);
        assert_eq!(clock_check(now, None).fix, None);
    }
}

//! Is the time that days start by to be relied on?

use super::checked::Checked;
use faceoff_types::Zone;
use jiff::{SignedDuration, Timestamp};
use std::{
    path::Path,
    process::{Command, Stdio},
};

/// How far ahead of this clock a file's time may be: file systems round.
const AHEAD: SignedDuration = SignedDuration::from_secs(5);

/// The clock: who sets it, and whether it is behind what the data folder has seen already.
pub fn clock(data_dir: &Path, now: Timestamp) -> Checked {
    let newest = ["faceoff.sqlite3", "faceoff.sqlite3-wal"]
        .iter()
        .filter_map(|name| data_dir.join(name).metadata().ok()?.modified().ok())
        .max();
    if let Some(newest) = newest.and_then(|at| Timestamp::try_from(at).ok())
        && newest.duration_since(now) > AHEAD
    {
        return Checked {
            name: "clock",
            found: format!("{now:.0} is before the last change of the database, {newest:.0}"),
            cure: Some(
                "set the clock: days would start at the wrong time, or not at all until it has caught up".to_owned(),
            ),
        };
    }
    judged(now, synchronised())
}

fn judged(now: Timestamp, synchronised: Option<bool>) -> Checked {
    let (found, cure) = match synchronised {
        Some(true) => ("set by the network's time", None),
        Some(false) => (
            "not set by the network's time",
            Some("timedatectl set-ntp true, or chrony: cuts follow this clock"),
        ),
        None => ("this host does not tell who sets it", None),
    };
    Checked {
        name: "clock",
        found: format!("{now:.0}, {found}"),
        cure: cure.map(str::to_owned),
    }
}

/// What systemd says; `None` where it says nothing.
fn synchronised() -> Option<bool> {
    let told = Command::new("timedatectl")
        .args(["show", "--property=NTPSynchronized", "--value"])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    match String::from_utf8_lossy(&told.stdout).trim() {
        "yes" => Some(true),
        "no" => Some(false),
        _ => None,
    }
}

/// The zone that a new season's days are dates of.
pub fn zone(zone: &Zone, now: Timestamp) -> Checked {
    let here = now.to_zoned(zone.time_zone());
    Checked {
        name: "time zone",
        found: format!(
            "evaluation.zone is {zone}: it is {} there",
            here.strftime("%Y-%m-%d %H:%M:%S (UTC%:z)")
        ),
        cure: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_clock_that_is_behind_the_database_is_found() {
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
        assert!(behind.cure.is_some());
        assert!(!clock(folder.path(), now + hour).found.contains("before"));
    }

    #[test]
    fn who_sets_the_clock_is_told_where_the_host_tells() {
        let now = Timestamp::UNIX_EPOCH;
        assert!(judged(now, Some(false)).cure.unwrap().contains("set-ntp"));
        assert_eq!(judged(now, Some(true)).cure, None);
        assert_eq!(judged(now, None).cure, None);
    }
}

//! Stopping a whole tree at once, beyond its own reach: no signal that it could catch, send or wait for.

use super::hierarchy::Version;
use std::{
    fs::{self, File},
    os::unix::fs::FileExt,
    path::Path,
};

/// What stops the tasks of one cgroup. They stop where they next leave the kernel; nobody waits for that.
#[derive(Debug)]
pub(crate) struct Freezer {
    version: Version,
    state: File,
}

impl Freezer {
    /// That of `leaf`; `None` where the kernel has none or this user may not use it.
    pub(super) fn open(version: Version, leaf: &Path) -> Option<Self> {
        let state = fs::OpenOptions::new()
            .write(true)
            .open(leaf.join(file(version)))
            .ok()?;
        Some(Self { version, state })
    }

    /// Tells whether it did.
    pub(crate) fn freeze(&self) -> bool {
        self.set(match self.version {
            Version::V1 => "FROZEN",
            Version::V2 => "1",
        })
    }

    /// Tells whether it did. Of what is not frozen nothing changes.
    pub(crate) fn thaw(&self) -> bool {
        self.set(match self.version {
            Version::V1 => "THAWED",
            Version::V2 => "0",
        })
    }

    fn set(&self, state: &str) -> bool {
        let set = self.state.write_at(state.as_bytes(), 0);
        if let Err(error) = &set {
            tracing::warn!(%error, state, "an agent's freezer does not obey");
        }
        set.is_ok()
    }
}

/// Lets a dead service's agents go on, so that they can die.
pub(super) fn thaw_leaf(leaf: &Path) {
    for (version, state) in [(Version::V1, "THAWED"), (Version::V2, "0")] {
        let file = leaf.join(file(version));
        if file.exists() {
            let _ = fs::write(file, state);
        }
    }
}

const fn file(version: Version) -> &'static str {
    match version {
        Version::V1 => "freezer.state",
        Version::V2 => "cgroup.freeze",
    }
}

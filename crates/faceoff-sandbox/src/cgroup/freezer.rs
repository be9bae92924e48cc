//! Freezes a whole process tree at once, without signals, which an agent could catch, send or wait for.

use super::hierarchy::Version;
use std::{
    fs::{self, File},
    os::unix::fs::FileExt,
    path::Path,
};

/// Freezer of one cgroup. A task freezes when it next leaves the kernel, which a long system call can delay. Until
/// then the lowest CPU weight keeps it from taking time from others.
#[derive(Debug)]
pub(crate) struct Freezer {
    version: Version,
    state: File,
    /// CPU weight of the cgroup, if the controller is available.
    weight: Option<Weight>,
}

/// The CPU weight of a cgroup: its share of a CPU that others want as well.
#[derive(Debug)]
struct Weight {
    file: File,
    ordinary: &'static str,
    least: &'static str,
}

impl Weight {
    fn open(version: Version, leaf: &Path) -> Option<Self> {
        let (name, ordinary, least) = match version {
            Version::V1 => ("cpu.shares", "1024", "2"),
            Version::V2 => ("cpu.weight", "100", "1"),
        };
        let file = fs::OpenOptions::new().write(true).open(leaf.join(name));
        Some(Self {
            file: file.ok()?,
            ordinary,
            least,
        })
    }

    fn set(&self, weight: &str) {
        if let Err(error) = self.file.write_at(weight.as_bytes(), 0) {
            tracing::warn!(%error, weight, "an agent's weight cannot be set");
        }
    }
}

impl Freezer {
    /// Opens the freezer of `leaf`, and the CPU weight in the cgroup `cpu`. `None` if the kernel has no freezer, or
    /// this user may not use it.
    pub(super) fn open(
        version: Version,
        leaf: &Path,
        cpu: Option<(Version, &Path)>,
    ) -> Option<Self> {
        let state = fs::OpenOptions::new()
            .write(true)
            .open(leaf.join(state_file(version)))
            .ok()?;
        Some(Self {
            version,
            state,
            weight: cpu.and_then(|(version, leaf)| Weight::open(version, leaf)),
        })
    }

    /// Freezes the cgroup; returns whether the kernel accepted the request.
    pub(crate) fn freeze(&self) -> bool {
        if let Some(weight) = &self.weight {
            weight.set(weight.least);
        }
        self.set(match self.version {
            Version::V1 => "FROZEN",
            Version::V2 => "1",
        })
    }

    /// Thaws the cgroup, if it is frozen; returns whether the kernel accepted the request.
    pub(crate) fn thaw(&self) -> bool {
        let thawed = self.set(match self.version {
            Version::V1 => "THAWED",
            Version::V2 => "0",
        });
        if let Some(weight) = &self.weight {
            weight.set(weight.ordinary);
        }
        thawed
    }

    fn set(&self, state: &str) -> bool {
        let set = self.state.write_at(state.as_bytes(), 0);
        if let Err(error) = &set {
            tracing::warn!(%error, state, "the state of an agent's freezer cannot be set");
        }
        set.is_ok()
    }
}

/// Thaws an agent whose service (the process that started it) is dead, so that it can die.
pub(super) fn thaw_leaf(leaf: &Path) {
    for (version, state) in [(Version::V1, "THAWED"), (Version::V2, "0")] {
        let file = leaf.join(state_file(version));
        if file.exists() {
            let _ = fs::write(file, state);
        }
    }
}

/// The file by which a cgroup is frozen.
const fn state_file(version: Version) -> &'static str {
    match version {
        Version::V1 => "freezer.state",
        Version::V2 => "cgroup.freeze",
    }
}

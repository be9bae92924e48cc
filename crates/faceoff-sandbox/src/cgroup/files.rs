//! Small reads and writes of cgroup files.

use crate::{SandboxError, error::IoContext};
use std::{fs, io, path::Path};

pub(super) fn read(path: &Path) -> io::Result<String> {
    fs::read_to_string(path)
}

/// Reads a file that contains one number.
pub(super) fn read_number(path: &Path) -> Option<u64> {
    read(path).ok()?.trim().parse().ok()
}

/// Reads the number after `key` in a file of `key number` lines.
pub(super) fn read_keyed(path: &Path, key: &str) -> Option<u64> {
    let text = read(path).ok()?;
    text.lines().find_map(|line| {
        line.strip_prefix(key)?
            .strip_prefix(' ')?
            .trim()
            .parse()
            .ok()
    })
}

pub(super) fn write(path: &Path, value: &str) -> Result<(), SandboxError> {
    fs::write(path, value).context(format_args!("cannot write {value:?} to {}", path.display()))
}

/// The processes directly in the cgroup `dir`, without its children.
pub(super) fn processes(dir: &Path) -> Vec<i32> {
    let text = read(&dir.join("cgroup.procs")).unwrap_or_default();
    text.lines().filter_map(|line| line.parse().ok()).collect()
}

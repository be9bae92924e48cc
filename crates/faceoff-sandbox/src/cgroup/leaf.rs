//! The folder of one agent in one hierarchy: its name, and its end.

use super::{files, freezer::thaw_leaf};
use crate::owner::Owner;
use rustix::process::{Pid, Signal, kill_process};
use std::{
    fs, io,
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

pub(super) const LEAF_PREFIX: &str = "agent-";
static NEXT: AtomicU64 = AtomicU64::new(0);

/// Kills the processes of `leaf`, waits for their end and removes it, and the folder above it with the
/// last one. What cannot be removed is logged and left for the next start's sweep.
pub(super) fn remove_leaf(leaf: &Path) {
    /// The kernel lets go of a dead process's cgroup a moment after its parent has seen it end.
    const PATIENCE: Duration = Duration::from_secs(60);
    let deadline = Instant::now() + PATIENCE;
    loop {
        end_all(leaf);
        match fs::remove_dir(leaf) {
            Ok(()) => break,
            Err(error) if error.kind() == io::ErrorKind::NotFound => break,
            Err(error) if Instant::now() >= deadline => {
                tracing::error!(cgroup = %leaf.display(), %error, "an agent's cgroup could not be removed");
                return;
            }
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    if let Some(folder) = leaf.parent() {
        // Fails while other agents are in it, as it should.
        let _ = fs::remove_dir(folder);
    }
}

/// Kills every process of the cgroup, and lets frozen ones go on to die: version 1 keeps them otherwise.
pub(crate) fn end_all(leaf: &Path) {
    kill_all(leaf);
    thaw_leaf(leaf);
}

fn kill_all(leaf: &Path) {
    if fs::write(leaf.join("cgroup.kill"), "1").is_ok() {
        return;
    }
    for pid in files::processes(leaf).into_iter().filter_map(Pid::from_raw) {
        let _ = kill_process(pid, Signal::KILL);
    }
}

/// `agent-<pid>-<start time>-<namespace>-<number>`: whose it is can be told after that service has died.
pub(super) fn leaf_name() -> String {
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    format!("{}{number}", Owner::this_process().name(LEAF_PREFIX))
}

//! The folder (*leaf*) of one agent in one cgroup hierarchy: its name and its removal.

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
static NEXT_NUMBER: AtomicU64 = AtomicU64::new(0);

/// Kills the processes of `leaf`, waits for their end and removes the folder. The last leaf also removes its parent
/// folder. A leaf that cannot be removed is logged and left for [`remove_stale_leaves`](super::remove_stale_leaves) at the next start.
pub(super) fn remove_leaf(leaf: &Path) {
    /// Ample: the kernel releases a dead process's cgroup shortly after the parent has reaped the process.
    const TIMEOUT: Duration = Duration::from_secs(60);
    let deadline = Instant::now() + TIMEOUT;
    loop {
        kill_and_thaw(leaf);
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
        // Fails, as intended, while it contains other agents.
        let _ = fs::remove_dir(folder);
    }
}

/// Kills every process of the cgroup and thaws it: in version 1, a frozen process does not die.
pub(crate) fn kill_and_thaw(leaf: &Path) {
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

/// `agent-<pid>-<start time>-<namespace>-<number>`: the first three identify the process that started the agent, even after its
/// death.
pub(super) fn leaf_name() -> String {
    let number = NEXT_NUMBER.fetch_add(1, Ordering::Relaxed);
    format!("{}{number}", Owner::this_process().name_prefix(LEAF_PREFIX))
}

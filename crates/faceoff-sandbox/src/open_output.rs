//! Detects an agent that has closed its standard output and still runs.
//!
//! bubblewrap's own processes inherit the file descriptor of the output and keep it open as long as they live. So the kernel reports no
//! end of file when the agent closes its output. `/proc` shows which other processes have the output open.

use rustix::process::Pid;
use std::{fs, io};

/// Maximum number of inspected descriptors. A check must cost the evaluator at most a few milliseconds, so an agent with
/// more descriptors counts as still having its output open.
const MAX_DESCRIPTORS: usize = 4096;

/// Does a process of `tree` other than `helpers` (bubblewrap's) have a descriptor that `/proc` names `output`? Also `true` if this is
/// unknown; then the evaluator waits until the deadline of the answer.
pub(crate) fn is_open_in_tree(
    output: &str,
    tree: &[Pid],
    helpers: impl Iterator<Item = Pid>,
) -> bool {
    let helpers: Vec<_> = helpers.collect();
    let others: Vec<_> = tree.iter().filter(|pid| !helpers.contains(pid)).collect();
    let mut remaining = MAX_DESCRIPTORS;
    others.is_empty()
        || others.into_iter().any(|pid| {
            remaining == 0 || has_open(pid.as_raw_nonzero().get(), output, &mut remaining)
        })
}

fn has_open(pid: i32, output: &str, remaining: &mut usize) -> bool {
    match fs::read_dir(format!("/proc/{pid}/fd")) {
        Ok(entries) => entries.flatten().any(|entry| {
            *remaining = remaining.saturating_sub(1);
            *remaining == 0
                || fs::read_link(entry.path()).is_ok_and(|target| target.as_os_str() == output)
        }),
        Err(error) => error.kind() != io::ErrorKind::NotFound,
    }
}

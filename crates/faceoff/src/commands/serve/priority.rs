//! The priority of requests, database and schedule: lower than that of slots, so that requests do not disturb evaluations.

use anyhow::Context;
use faceoff_sandbox::affinity;
use tokio::runtime::{Builder, Runtime};

/// An async runtime whose threads have a lower priority than slots. Also lowers the priority of the calling thread, because threads
/// inherit the priority of the thread that starts them, usually this one. A thread that the runtime starts for a slot lowers its
/// own priority; a database connection that a slot opens keeps the slot's.
///
/// # Errors
/// If the runtime cannot be started.
pub(super) fn low_priority_runtime(cpus: &[usize]) -> anyhow::Result<Runtime> {
    lower_priority(cpus);
    let nice = affinity::niceness().unwrap_or_default();
    let cpus = cpus.to_vec();
    Builder::new_multi_thread()
        .enable_all()
        .thread_name("http")
        .on_thread_start(move || {
            // The thread was started by a slot and has inherited the slot's priority.
            if affinity::niceness().is_ok_and(|thread_nice| thread_nice < nice) {
                lower_priority(&cpus);
            }
        })
        .build()
        .context("starting the async runtime")
}

fn lower_priority(cpus: &[usize]) {
    if let Err(error) = affinity::lower_priority(cpus) {
        tracing::warn!(%error, ?cpus, "cannot lower the priority of requests, which may disturb slots");
    }
}

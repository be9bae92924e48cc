//! A single thread that forks all children.
//!
//! The kernel ties the parent-death signal to the thread that forked, not to the process. A caller's thread
//! may end while its agent still runs (in a thread pool, say). So the fork happens on a thread that lives as
//! long as the process.

use crate::affinity;
use std::{
    io,
    process::{Child, Command},
    sync::{Mutex, OnceLock, mpsc},
};

type SpawnRequest = (Command, mpsc::SyncSender<io::Result<Child>>);
static SPAWNER: OnceLock<Mutex<mpsc::Sender<SpawnRequest>>> = OnceLock::new();

/// Starts `command` as a child of the long-lived thread. The command, and every descriptor that its set-up
/// closure owns, is dropped before this returns.
pub(crate) fn spawn(command: Command) -> io::Result<Child> {
    let sender = spawner()?;
    let (reply, result) = mpsc::sync_channel(1);
    let thread_ended = || io::Error::other("the thread that starts agents has ended");
    sender.send((command, reply)).map_err(|_| thread_ended())?;
    result.recv().map_err(|_| thread_ended())?
}

fn spawner() -> io::Result<mpsc::Sender<SpawnRequest>> {
    if SPAWNER.get().is_none() {
        let (sender, requests) = mpsc::channel::<SpawnRequest>();
        std::thread::Builder::new()
            .name("agent-spawner".into())
            .spawn(move || run(&requests))?;
        // A race costs one thread, which ends at once because its channel is closed.
        let _ = SPAWNER.set(Mutex::new(sender));
    }
    let lock = SPAWNER
        .get()
        .ok_or_else(|| io::Error::other("the thread that starts agents is missing"))?;
    Ok(lock
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
        .clone())
}

fn run(requests: &mpsc::Receiver<SpawnRequest>) {
    // A worker slot pinned to its own CPUs may have started this thread; children must not inherit that
    // affinity. The main thread has the affinity of the service.
    affinity::reset_to_process();
    for (mut command, reply) in requests {
        let child = command.spawn();
        drop(command);
        // The caller waits for this answer; if it is gone, the child must be killed.
        if let Err(mpsc::SendError(Ok(mut orphan))) = reply.send(child) {
            let _ = orphan.kill();
            let _ = orphan.wait();
        }
    }
}

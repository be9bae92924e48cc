//! One thread starts all children.
//!
//! "Die with the parent" is, to the kernel, "die with the thread that forked you". Callers come and go
//! (a pool's thread may end while its agent plays on), so the fork happens on a thread that lives as
//! long as the process.

use crate::affinity;
use std::{
    io,
    process::{Child, Command},
    sync::{Mutex, OnceLock, mpsc},
};

type Job = (Command, mpsc::SyncSender<io::Result<Child>>);
static SPAWNER: OnceLock<Mutex<mpsc::Sender<Job>>> = OnceLock::new();

/// Starts `command` as a child of the long-lived thread. The command, and with it every descriptor that
/// its set-up closure owns, is dropped before this returns.
pub(crate) fn spawn(command: Command) -> io::Result<Child> {
    let sender = spawner()?;
    let (answer, result) = mpsc::sync_channel(1);
    let gone = || io::Error::other("the thread that starts agents has ended");
    sender.send((command, answer)).map_err(|_| gone())?;
    result.recv().map_err(|_| gone())?
}

fn spawner() -> io::Result<mpsc::Sender<Job>> {
    if SPAWNER.get().is_none() {
        let (sender, jobs) = mpsc::channel::<Job>();
        std::thread::Builder::new()
            .name("agent-spawner".into())
            .spawn(move || run(&jobs))?;
        // A race costs a thread that ends at once, its channel being closed.
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

fn run(jobs: &mpsc::Receiver<Job>) {
    // This thread may descend from a worker slot that is pinned to its own CPUs; children must not
    // inherit that. The main thread's set is the service's.
    affinity::as_the_process();
    for (mut command, answer) in jobs {
        let child = command.spawn();
        drop(command);
        // The caller waits for this; if it is gone, the child must not linger.
        if let Err(mpsc::SendError(Ok(mut orphan))) = answer.send(child) {
            let _ = orphan.kill();
            let _ = orphan.wait();
        }
    }
}

//! Standard error: drained by a thread, the end of it kept.

use rustix::{
    event::{PollFd, PollFlags, poll},
    io::Errno,
    net::{RecvFlags, recv},
    pipe::{PipeFlags, pipe_with},
};
use std::{
    collections::VecDeque,
    io,
    os::fd::OwnedFd,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::Duration,
};

const CHUNK_BYTES: usize = 64 << 10;
/// The pause after a chunk that came full. A log never fills 64 KiB between two reads; a flood does, and
/// this holds it to 64 MiB/s, little work for the service, while it blocks nobody but the flooder.
const PAUSE_AFTER_FULL_CHUNK: Duration = Duration::from_millis(1);

/// The thread that reads standard error, and what it keeps.
#[derive(Debug)]
pub(crate) struct StderrTail {
    tail: Arc<Mutex<VecDeque<u8>>>,
    thread: Option<JoinHandle<()>>,
    /// Dropped to end the thread although the agent's end is still open somewhere.
    stop: Option<OwnedFd>,
}

impl StderrTail {
    /// Starts draining `log`, a socket, keeping its last `keep_bytes`.
    pub(crate) fn drain(log: OwnedFd, keep_bytes: u64) -> io::Result<Self> {
        let (stop_seen, stop) = pipe_with(PipeFlags::CLOEXEC)?;
        let keep = usize::try_from(keep_bytes).unwrap_or(usize::MAX);
        let tail = Arc::new(Mutex::new(VecDeque::new()));
        let shared = Arc::clone(&tail);
        let thread = std::thread::Builder::new()
            .name("agent-stderr".into())
            .spawn(move || drain_until_closed(&log, &stop_seen, keep, &shared))?;
        Ok(Self {
            tail,
            thread: Some(thread),
            stop: Some(stop),
        })
    }

    /// What is kept so far, lossy UTF-8.
    pub(crate) fn text(&self) -> String {
        let mut tail = lock(&self.tail);
        String::from_utf8_lossy(tail.make_contiguous()).into_owned()
    }

    /// Takes what is still there and ends the thread. Call when the tree is dead.
    pub(crate) fn close(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for StderrTail {
    fn drop(&mut self) {
        self.close();
    }
}

fn lock(tail: &Mutex<VecDeque<u8>>) -> MutexGuard<'_, VecDeque<u8>> {
    tail.lock().unwrap_or_else(PoisonError::into_inner)
}

fn drain_until_closed(log: &OwnedFd, stop: &OwnedFd, keep: usize, tail: &Mutex<VecDeque<u8>>) {
    let mut chunk = vec![0; CHUNK_BYTES];
    // More than a socket holds when the writers are dead; a survivor's flood is not followed further.
    let mut left_after_stop = 1 << 20;
    loop {
        let mut fds = [
            PollFd::new(log, PollFlags::IN),
            PollFd::new(stop, PollFlags::IN),
        ];
        match poll(&mut fds, None) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return,
        }
        let stopped = !fds[1].revents().is_empty();
        match recv(log, &mut chunk[..], RecvFlags::DONTWAIT) {
            Ok((0, _)) => return,
            Ok((count, _)) => {
                let mut tail = lock(tail);
                tail.extend(&chunk[..count]);
                let excess = tail.len().saturating_sub(keep);
                tail.drain(..excess);
                drop(tail);
                if stopped {
                    left_after_stop -= count.min(left_after_stop);
                    if left_after_stop == 0 {
                        return;
                    }
                } else if count == CHUNK_BYTES {
                    std::thread::sleep(PAUSE_AFTER_FULL_CHUNK);
                }
            }
            Err(Errno::AGAIN) if stopped => return,
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => return,
        }
    }
}

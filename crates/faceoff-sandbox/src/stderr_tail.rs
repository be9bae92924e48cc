//! Standard error: drained by a thread, the end of it kept.

use crate::sched_stat::SchedStat;
use rustix::{
    event::{PollFd, PollFlags, poll},
    io::{Errno, ioctl_fionread},
    net::{RecvFlags, recv},
    pipe::{PipeFlags, pipe_with},
    time::{ClockId, clock_gettime},
};
use std::{
    collections::VecDeque,
    fs::File,
    io,
    os::fd::OwnedFd,
    sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc},
    thread::JoinHandle,
    time::Duration,
};

const CHUNK_BYTES: usize = 64 << 10;
/// The pause after each read: a flood, be it of a byte at a time, wakes the service a thousand times a second at
/// most, and blocks nobody but the flooder. A log has room for as long.
const PAUSE: Duration = Duration::from_millis(1);
/// … or, if that is longer, so many times the CPU time that the read took: whoever polls the other end from a
/// hundred thousand places makes each byte dear.
const PAUSE_PER_CPU_TIME: u32 = 20;
/// A read that takes more CPU time is the last one of this log.
const DEAREST_READ: Duration = Duration::from_millis(20);

/// The thread that reads standard error, and what it keeps.
#[derive(Debug)]
pub(crate) struct StderrTail {
    tail: Arc<Mutex<VecDeque<u8>>>,
    /// What the kernel tells of the thread.
    schedule: Option<File>,
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
        let (tell, told) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name("agent-stderr".into())
            .spawn(move || {
                let _ = tell.send(File::open("/proc/thread-self/schedstat").ok());
                drop(tell);
                drain_until_closed(&log, &stop_seen, keep, &shared);
            })?;
        Ok(Self {
            tail,
            schedule: told.recv().ok().flatten(),
            thread: Some(thread),
            stop: Some(stop),
        })
    }

    /// What is kept so far, lossy UTF-8.
    pub(crate) fn text(&self) -> String {
        let mut tail = lock(&self.tail);
        String::from_utf8_lossy(tail.make_contiguous()).into_owned()
    }

    /// For how long the thread has run: on the evaluator's CPU, and because of what the agent writes.
    pub(crate) fn ran(&self) -> Duration {
        let file = self.schedule.as_ref();
        file.and_then(SchedStat::read).unwrap_or_default().ran
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
    let keep_end = |bytes: &[u8]| {
        let mut tail = lock(tail);
        tail.extend(bytes);
        let excess = tail.len().saturating_sub(keep);
        tail.drain(..excess);
    };
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
        // What is there now: a read goes on as long as the agent adds to it.
        let there = ioctl_fionread(log).unwrap_or(0);
        let most = usize::try_from(there)
            .unwrap_or(CHUNK_BYTES)
            .clamp(1, CHUNK_BYTES);
        let before = own_cpu_time();
        match recv(log, &mut chunk[..most], RecvFlags::DONTWAIT) {
            Ok((0, _)) => return,
            Ok((count, _)) => {
                keep_end(&chunk[..count]);
                let took = own_cpu_time().saturating_sub(before);
                if stopped {
                    left_after_stop -= count.min(left_after_stop);
                    if left_after_stop == 0 {
                        return;
                    }
                } else if took > DEAREST_READ {
                    keep_end(b"\n[faceoff] this log is not read any further: to read it takes the evaluator too long\n");
                    return;
                } else {
                    std::thread::sleep(PAUSE.max(took * PAUSE_PER_CPU_TIME));
                }
            }
            Err(Errno::AGAIN) if stopped => return,
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => return,
        }
    }
}

/// CPU time of the calling thread.
fn own_cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    Duration::new(seconds, u32::try_from(time.tv_nsec).unwrap_or(0))
}

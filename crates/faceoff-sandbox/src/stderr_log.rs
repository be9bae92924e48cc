//! Standard error of an agent, which is its log: a thread reads it and keeps its beginning and its end.

use crate::{bounded_log::BoundedLog, cpu_clock::own_cpu_time, sched_stat::SchedStat};
use rustix::{
    event::{PollFd, PollFlags, poll},
    io::{Errno, ioctl_fionread, read},
    pipe::{PipeFlags, pipe_with},
};
use std::{
    fs::File,
    io,
    os::fd::OwnedFd,
    sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc},
    thread::JoinHandle,
    time::Duration,
};

const CHUNK_BYTES: usize = 64 << 10;
/// Minimum pause after a read. A flood, even one byte at a time, wakes the evaluator at most a thousand times a
/// second, and only the flooding agent blocks. The pipe's buffer bridges the pause.
const PAUSE: Duration = Duration::from_millis(1);
/// The pause is at least this multiple of the CPU time of the read. An agent that polls the other end through a
/// hundred thousand descriptors makes each read expensive.
const PAUSE_PER_CPU_TIME: u32 = 20;
/// CPU time of one read above which the log is not read any further.
const MAX_READ_CPU_TIME: Duration = Duration::from_millis(20);

/// How long to wait for the thread to end.
const END_TIMEOUT: Duration = Duration::from_secs(10);

/// The thread that reads standard error, and the part that it keeps.
#[derive(Debug)]
pub(crate) struct StderrLog {
    kept: Arc<Mutex<BoundedLog>>,
    /// The kernel's scheduling counters of the thread.
    schedule: Option<File>,
    thread: Option<JoinHandle<()>>,
    /// Closed by the thread at its end.
    ended: mpsc::Receiver<()>,
    /// Dropped to stop the thread even if a process still has the writing end of the log open.
    stop: Option<OwnedFd>,
}

impl StderrLog {
    /// Starts a thread that reads the pipe `log` and keeps at most `max_bytes` of it.
    pub(crate) fn drain(log: OwnedFd, max_bytes: u64) -> io::Result<Self> {
        let (stop_reader, stop) = pipe_with(PipeFlags::CLOEXEC)?;
        let kept = Arc::new(Mutex::new(BoundedLog::new(max_bytes)));
        let shared = Arc::clone(&kept);
        let (sender, receiver) = mpsc::channel();
        let (end, ended) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name("agent-stderr".into())
            .spawn(move || {
                let _ = sender.send(File::open("/proc/thread-self/schedstat").ok());
                drop(sender);
                drain_until_closed(&log, &stop_reader, &shared);
                drop(end);
            })?;
        Ok(Self {
            kept,
            schedule: receiver.recv().ok().flatten(),
            thread: Some(thread),
            ended,
            stop: Some(stop),
        })
    }

    /// The kept parts of the log, lossy UTF-8.
    pub(crate) fn text(&self) -> String {
        lock(&self.kept).text()
    }

    /// Run time of the reading thread. It runs on the evaluator's CPUs, as long as the agent writes.
    pub(crate) fn reader_run_time(&self) -> Duration {
        let file = self.schedule.as_ref();
        file.and_then(SchedStat::read).unwrap_or_default().run_time
    }

    /// Reads the remaining bytes and ends the thread. Call it when the process tree is dead: a process that has escaped, which only
    /// namespaces prevent, could hold the lock of the pipe, and the thread with it.
    pub(crate) fn close(&mut self) {
        drop(self.stop.take());
        let Some(thread) = self.thread.take() else {
            return;
        };
        if self.ended.recv_timeout(END_TIMEOUT) == Err(mpsc::RecvTimeoutError::Timeout) {
            tracing::error!("a process of an agent that has ended still holds its log");
            return;
        }
        let _ = thread.join();
    }
}

impl Drop for StderrLog {
    fn drop(&mut self) {
        self.close();
    }
}

fn lock(kept: &Mutex<BoundedLog>) -> MutexGuard<'_, BoundedLog> {
    kept.lock().unwrap_or_else(PoisonError::into_inner)
}

fn drain_until_closed(log: &OwnedFd, stop: &OwnedFd, kept: &Mutex<BoundedLog>) {
    let mut chunk = vec![0; CHUNK_BYTES];
    let keep = |bytes: &[u8]| lock(kept).push(bytes);
    // More than a pipe can hold, so a log whose writers have died is read completely. If a writer survives, reading ends after this many
    // bytes.
    let mut remaining_bytes_after_stop = 1 << 20;
    loop {
        let mut fds = [
            PollFd::new(log, PollFlags::IN),
            PollFd::new(stop, PollFlags::IN),
        ];
        match poll(&mut fds, None) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return,
        }
        let is_stopped = !fds[1].revents().is_empty();
        // Read only the bytes available now: a read without a limit continues as long as the agent writes.
        let available = ioctl_fionread(log).unwrap_or(0);
        let limit = usize::try_from(available)
            .unwrap_or(CHUNK_BYTES)
            .clamp(1, CHUNK_BYTES);
        let cpu_time_before = own_cpu_time();
        match read(log, &mut chunk[..limit]) {
            Ok(0) => return,
            Ok(count) => {
                keep(&chunk[..count]);
                let cpu_time = own_cpu_time().saturating_sub(cpu_time_before);
                if is_stopped {
                    remaining_bytes_after_stop -= count.min(remaining_bytes_after_stop);
                    if remaining_bytes_after_stop == 0 {
                        return;
                    }
                } else if cpu_time > MAX_READ_CPU_TIME {
                    keep(
                        b"\n[faceoff] the rest of this log is not read: reading it takes the evaluator too much CPU \
                          time\n",
                    );
                    return;
                } else {
                    std::thread::sleep(PAUSE.max(cpu_time * PAUSE_PER_CPU_TIME));
                }
            }
            Err(Errno::AGAIN) if is_stopped => return,
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => return,
        }
    }
}

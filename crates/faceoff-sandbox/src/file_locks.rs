//! Locks of whole files (`flock`), which an agent may take on files of its own only.
//!
//! A lock on a file that other agents see, too, is a channel between them: each could find whether it is locked. The filter sees the number
//! of a descriptor but not its file. So this process takes the lock for the agent: it fetches a further descriptor of the same open file,
//! to which a lock belongs, looks at the file, and locks that descriptor. The agent cannot exchange the file in between.

use crate::{call_listener::check_waiting, caller::Caller};
use rustix::{
    fs::{FlockOperation, flock, fstat},
    io::Errno,
};
use std::{
    io,
    os::fd::{BorrowedFd, OwnedFd},
    time::{Duration, Instant},
};

/// Folders whose file systems are an agent's own.
const OWN_FOLDERS: [&str; 2] = ["/tmp", "/dev/shm"];
/// Locks for which an agent's threads may wait at once: each takes a descriptor of this process.
const MAX_WAITING: usize = 32;
/// Pause before a lock that is taken is tried again; it doubles with each attempt.
const FIRST_PAUSE: Duration = Duration::from_millis(1);
const LONGEST_PAUSE: Duration = Duration::from_millis(50);

/// The locks for which threads of the agent wait.
#[derive(Debug, Default)]
pub(crate) struct FileLocks {
    waiting: Vec<WaitingLock>,
}

#[derive(Debug)]
struct WaitingLock {
    call: u64,
    file: OwnedFd,
    operation: FlockOperation,
    pause: Duration,
    next_try_at: Instant,
}

/// The outcome of a call of `flock`.
#[derive(Debug)]
pub(crate) enum LockOutcome {
    /// The call has succeeded.
    Done,
    /// The call has locked this file.
    Locked(OwnedFd),
    Failed(Errno),
    /// It is answered later.
    Waits,
}

impl FileLocks {
    /// Executes `flock(number, operation)` of the caller. `has_own_files`: are [`OWN_FOLDERS`] the agent's own?
    pub(crate) fn lock(
        &mut self,
        caller: Caller<'_>,
        number: i32,
        operation: i32,
        has_own_files: bool,
    ) -> io::Result<LockOutcome> {
        let may_wait = operation & libc::LOCK_NB == 0;
        let operation = match operation & !libc::LOCK_NB {
            libc::LOCK_SH => FlockOperation::NonBlockingLockShared,
            libc::LOCK_EX => FlockOperation::NonBlockingLockExclusive,
            libc::LOCK_UN => FlockOperation::NonBlockingUnlock,
            _ => return Ok(LockOutcome::Failed(Errno::INVAL)),
        };
        let devices: Vec<_> = OWN_FOLDERS
            .iter()
            .filter(|_| has_own_files)
            .filter_map(|folder| caller.device_of_folder(folder).ok())
            .collect();
        // Looked at before it is fetched: if the agent closes a socket or a pipe meanwhile, its end here could take long.
        if !caller.is_file_on(number, &devices)? {
            return Ok(shared_file_outcome(operation));
        }
        let file = caller.file(number)?;
        if !devices.contains(&fstat(&file)?.st_dev) {
            return Ok(shared_file_outcome(operation));
        }
        match flock(&file, operation) {
            Ok(()) => Ok(LockOutcome::Locked(file)),
            Err(Errno::WOULDBLOCK) if may_wait && !self.has_capacity(caller.listener) => {
                Ok(LockOutcome::Failed(Errno::NOLCK))
            }
            Err(Errno::WOULDBLOCK) if may_wait => {
                self.waiting.push(WaitingLock {
                    call: caller.id,
                    file,
                    operation,
                    pause: FIRST_PAUSE,
                    next_try_at: Instant::now() + FIRST_PAUSE,
                });
                Ok(LockOutcome::Waits)
            }
            Err(error) => Ok(LockOutcome::Failed(error)),
        }
    }

    /// May another thread wait? Those that were killed meanwhile are forgotten.
    fn has_capacity(&mut self, listener: BorrowedFd<'_>) -> bool {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting
                .retain(|lock| check_waiting(listener, lock.call).is_ok());
        }
        self.waiting.len() < MAX_WAITING
    }

    /// When to call [`Self::retry`] next.
    pub(crate) fn next_try_at(&self) -> Option<Instant> {
        self.waiting.iter().map(|lock| lock.next_try_at).min()
    }

    /// Tries the locks whose pause is over; returns the calls to answer.
    pub(crate) fn retry(
        &mut self,
        listener: BorrowedFd<'_>,
        now: Instant,
    ) -> Vec<(u64, LockOutcome)> {
        let mut answers = Vec::new();
        for mut lock in std::mem::take(&mut self.waiting) {
            if now < lock.next_try_at {
                self.waiting.push(lock);
                continue;
            }
            if check_waiting(listener, lock.call).is_err() {
                // The thread has been killed.
                continue;
            }
            match flock(&lock.file, lock.operation) {
                Err(Errno::WOULDBLOCK) => {
                    lock.pause = (lock.pause * 2).min(LONGEST_PAUSE);
                    lock.next_try_at = now + lock.pause;
                    self.waiting.push(lock);
                }
                Ok(()) => answers.push((lock.call, LockOutcome::Locked(lock.file))),
                Err(error) => answers.push((lock.call, LockOutcome::Failed(error))),
            }
        }
        answers
    }
}

/// No process can write to a shared file, so a shared lock excludes none; it succeeds without effect.
fn shared_file_outcome(operation: FlockOperation) -> LockOutcome {
    match operation {
        FlockOperation::NonBlockingLockExclusive => LockOutcome::Failed(Errno::NOSYS),
        _ => LockOutcome::Done,
    }
}

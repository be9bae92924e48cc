//! Locks of whole files (`flock`), which an agent may take on files of its own only.
//!
//! A lock on a file that other agents see, too, is a channel between them: each could find whether it is locked. The filter sees the number
//! of a descriptor but not its file. So the service takes the lock for the agent: it fetches a further descriptor of the same open file,
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

/// What a call that locks comes to.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum LockOutcome {
    /// The call has succeeded.
    Done,
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
        let file = caller.file(number)?;
        let device = fstat(&file)?.st_dev;
        let is_own = has_own_files
            && OWN_FOLDERS
                .iter()
                .any(|folder| caller.file_system(folder).is_ok_and(|own| own == device));
        if !is_own {
            // Nobody can write to it, so a shared lock excludes nobody; it succeeds without effect.
            return Ok(match operation {
                FlockOperation::NonBlockingLockExclusive => LockOutcome::Failed(Errno::NOSYS),
                _ => LockOutcome::Done,
            });
        }
        match flock(&file, operation) {
            Ok(()) => Ok(LockOutcome::Done),
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
        self.waiting.retain_mut(|lock| {
            if now < lock.next_try_at {
                return true;
            }
            if check_waiting(listener, lock.call).is_err() {
                // The thread has been killed.
                return false;
            }
            match flock(&lock.file, lock.operation) {
                Err(Errno::WOULDBLOCK) => {
                    lock.pause = (lock.pause * 2).min(LONGEST_PAUSE);
                    lock.next_try_at = now + lock.pause;
                    return true;
                }
                Ok(()) => answers.push((lock.call, LockOutcome::Done)),
                Err(error) => answers.push((lock.call, LockOutcome::Failed(error))),
            }
            false
        });
        answers
    }
}

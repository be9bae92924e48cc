//! Numbers of sessions (the process sessions that `setsid` starts), which the kernel counts for the whole host.
//!
//! A new session gets a scheduling group with the next number, which `/proc/self/autogroup` shows. An agent could count to a value that a
//! later agent reads. So an agent may start few sessions, and after its end a random number of them is skipped, up to many times its own.
//! Two agents that run at once can still see each other's sessions.

use crate::affinity;
use rustix::{
    rand::{GetRandomFlags, getrandom},
    thread::sched_getcpu,
};
use std::time::{Duration, Instant};

/// Number of sessions that an agent may start at once; the first is bubblewrap's.
const MAX_SESSIONS_AT_ONCE: f64 = 9.0;
/// Time after which it may start another one.
const TIME_PER_SESSION: Duration = Duration::from_secs(10);
/// A random number of sessions is skipped: fewer than the larger of this number and `MAX_SKIPPED_PER_SESSION` for each session of the
/// agent.
const MAX_SKIPPED: u32 = 128;
const MAX_SKIPPED_PER_SESSION: u32 = 16;

/// Sessions that an agent may still start.
pub(crate) struct SessionBudget {
    /// Number of sessions started.
    pub started: u32,
    /// Number of sessions that may be started now; it grows with time, so it has a fractional part.
    available: f64,
    updated_at: Instant,
}

impl SessionBudget {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            started: 0,
            available: MAX_SESSIONS_AT_ONCE,
            updated_at: now,
        }
    }

    /// May the agent start another session now? Then it is counted.
    pub(crate) fn take(&mut self, now: Instant) -> bool {
        let waited = now.saturating_duration_since(self.updated_at);
        self.updated_at = now;
        let gained = waited.as_secs_f64() / TIME_PER_SESSION.as_secs_f64();
        self.available = (self.available + gained).min(MAX_SESSIONS_AT_ONCE);
        let may_start = self.available >= 1.0;
        if may_start {
            self.available -= 1.0;
            self.started += 1;
        }
        may_start
    }
}

/// Starts a random number of sessions that end at once, after an agent that has started `started` sessions. The calling thread stays on
/// the CPU on which it is.
pub(crate) fn skip_some(started: u32) {
    let mut random = [0; 4];
    if getrandom(&mut random, GetRandomFlags::empty()).is_err() {
        return;
    }
    // On several CPUs the skipping takes longer, since an idle CPU must wake up for a process. If pinning fails, only time is lost.
    let _ = affinity::pin_current_thread(&[sched_getcpu()]);
    let limit = MAX_SKIPPED.max(started.saturating_mul(MAX_SKIPPED_PER_SESSION));
    for _ in 0..u32::from_ne_bytes(random) % limit {
        if !skip_one() {
            return;
        }
    }
}

/// Starts a session in a process that ends at once; `false` if there can be no further process now.
fn skip_one() -> bool {
    const STACK_BYTES: usize = 16 << 10;
    extern "C" fn start_session(_: *mut libc::c_void) -> libc::c_int {
        #[expect(unsafe_code, reason = "rustix's function is not callable from here")]
        // SAFETY: the call takes no arguments. It sets `errno` of the thread that waits, which nothing reads.
        unsafe {
            libc::setsid();
        }
        0
    }
    // A stack is aligned to 16 bytes.
    let mut stack = vec![0_u128; STACK_BYTES / size_of::<u128>()];
    // Without a signal at its end, so that no other code of this process waits for it. It shares the open files and does not duplicate
    // them: a program of a bundle that is just being written could not be started while it is open for writing elsewhere.
    let flags = libc::CLONE_VM | libc::CLONE_VFORK | libc::CLONE_FILES | libc::CLONE_FS;
    #[expect(unsafe_code, reason = "a fork would copy all tables of this process")]
    // SAFETY: the process runs `start_session` on a stack of its own, and this thread waits until it has ended. The function
    // makes one system call, and neither allocates nor locks nor unwinds.
    unsafe {
        let top = stack.as_mut_ptr_range().end;
        let pid = libc::clone(start_session, top.cast(), flags, std::ptr::null_mut());
        pid > 0 && libc::waitpid(pid, std::ptr::null_mut(), libc::__WCLONE) == pid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn session_budget_refills_slowly() {
        let start = Instant::now();
        let mut budget = SessionBudget::new(start);
        let mut started_at = |now| (0..100).filter(|_| budget.take(now)).count();
        assert_eq!(started_at(start), MAX_SESSIONS_AT_ONCE as usize);
        assert_eq!(started_at(start + TIME_PER_SESSION / 2), 0);
        assert_eq!(started_at(start + TIME_PER_SESSION), 1);
        assert_eq!(
            started_at(start + 1000 * TIME_PER_SESSION),
            MAX_SESSIONS_AT_ONCE as usize
        );
    }

    #[test]
    fn skipped_session_has_ended() {
        assert!((0..20).all(|_| skip_one()));
    }
}

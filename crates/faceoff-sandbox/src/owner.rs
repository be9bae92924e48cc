//! Which service made something that outlives a process: a cgroup, a folder.

use std::fs;

/// A service process: its pid, and when it started, because pids are used again. As text
/// `<pid>-<start time>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Owner {
    pid: u32,
    start: u64,
}

impl Owner {
    /// This process.
    pub(crate) fn this_process() -> Self {
        let pid = std::process::id();
        Self {
            pid,
            start: start_time(pid).unwrap_or(0),
        }
    }

    /// The owner in a name `<prefix><pid>-<start time>-…`; `None` for a name that is not ours.
    pub(crate) fn of_name(name: &str, prefix: &str) -> Option<Self> {
        let mut parts = name.strip_prefix(prefix)?.split('-');
        Some(Self {
            pid: parts.next()?.parse().ok()?,
            start: parts.next()?.parse().ok()?,
        })
    }

    /// The beginning of a name that [`Self::of_name`] reads.
    pub(crate) fn name(self, prefix: &str) -> String {
        format!("{prefix}{}-{}-", self.pid, self.start)
    }

    pub(crate) fn lives(self) -> bool {
        start_time(self.pid).is_some_and(|start| self.start == 0 || start == self.start)
    }
}

/// When process `pid` started, in clock ticks since boot; `None` if there is none, or a dead one.
fn start_time(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in parentheses, may hold anything; the fields after it are plain. State is the
    // first, the start time the 20th.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_living_service_is_told_from_one_whose_pid_was_used_again() {
        let us = Owner::this_process();
        assert!(us.lives());
        assert!(
            !Owner {
                start: us.start + 1,
                ..us
            }
            .lives()
        );
    }

    #[test]
    fn a_name_tells_its_owner_and_other_names_tell_nothing() {
        let us = Owner::this_process();
        assert_eq!(
            Owner::of_name(&format!("{}7", us.name("agent-")), "agent-"),
            Some(us)
        );
        assert_eq!(Owner::of_name("agent-12", "agent-"), None);
        assert_eq!(Owner::of_name("somebody-12-345-0", "agent-"), None);
    }
}

//! Which service made something that outlives a process: a cgroup, a folder.

use std::fs;

/// A service process: its pid, when it started, because pids are used again, and in which namespace of
/// pids. As text `<pid>-<start time>-<namespace>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Owner {
    pid: u32,
    start: u64,
    namespace: u64,
}

impl Owner {
    pub(crate) fn this_process() -> Self {
        let pid = std::process::id();
        Self {
            pid,
            start: start_time(pid).unwrap_or(0),
            namespace: pid_namespace(),
        }
    }

    /// The owner in a name `<prefix><pid>-<start time>-<namespace>-…`; `None` for a name that is not ours.
    pub(crate) fn of_name(name: &str, prefix: &str) -> Option<Self> {
        let mut parts = name.strip_prefix(prefix)?.split('-');
        Some(Self {
            pid: parts.next()?.parse().ok()?,
            start: parts.next()?.parse().ok()?,
            namespace: parts.next()?.parse().ok()?,
        })
    }

    /// The beginning of a name that [`Self::of_name`] reads.
    pub(crate) fn name(self, prefix: &str) -> String {
        format!("{prefix}{}-{}-{}-", self.pid, self.start, self.namespace)
    }

    /// Is it dead for certain? Of services in other containers we cannot tell, nor of any where `/proc` is
    /// hidden, so they count as alive.
    pub(crate) fn is_dead(self) -> bool {
        let us = Self::this_process();
        let can_tell = us.start != 0 && us.namespace == self.namespace;
        can_tell && start_time(self.pid) != Some(self.start)
    }
}

/// The number of this process's namespace of pids; 0 where it cannot be told.
fn pid_namespace() -> u64 {
    let link = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let digits: String = link
        .to_string_lossy()
        .chars()
        .filter(char::is_ascii_digit)
        .collect();
    digits.parse().unwrap_or(0)
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
        assert!(!us.is_dead());
        assert!(
            Owner {
                start: us.start + 1,
                ..us
            }
            .is_dead()
        );
        assert!(
            Owner {
                pid: u32::MAX,
                ..us
            }
            .is_dead()
        );
    }

    #[test]
    fn a_service_in_another_container_is_left_alone() {
        let us = Owner::this_process();
        assert!(
            !Owner {
                start: us.start + 1,
                namespace: us.namespace + 1,
                ..us
            }
            .is_dead()
        );
    }

    #[test]
    fn a_name_tells_its_owner_and_other_names_tell_nothing() {
        let us = Owner::this_process();
        assert_eq!(
            Owner::of_name(&format!("{}7", us.name("agent-")), "agent-"),
            Some(us)
        );
        assert_eq!(Owner::of_name("agent-12-345", "agent-"), None);
        assert_eq!(Owner::of_name("somebody-12-345-6-0", "agent-"), None);
    }
}

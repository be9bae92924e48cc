//! The owner of resources that outlive a process (cgroups, folders): the process of Faceoff that created them, here called *service*. It
//! is part of their names.

use std::fs;

/// A service process: its pid, its start time (because pids are reused) and its pid namespace.
/// As text `<pid>-<start time>-<namespace>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Owner {
    pid: u32,
    /// Start time in clock ticks since boot.
    start_ticks: u64,
    namespace: u64,
}

impl Owner {
    pub(crate) fn this_process() -> Self {
        let pid = std::process::id();
        Self {
            pid,
            start_ticks: start_ticks_of(pid).unwrap_or(0),
            namespace: pid_namespace(),
        }
    }

    /// The owner in a name `<prefix><pid>-<start time>-<namespace>-…`; `None` for any other name.
    pub(crate) fn parse(name: &str, prefix: &str) -> Option<Self> {
        let mut parts = name.strip_prefix(prefix)?.split('-');
        Some(Self {
            pid: parts.next()?.parse().ok()?,
            start_ticks: parts.next()?.parse().ok()?,
            namespace: parts.next()?.parse().ok()?,
        })
    }

    /// The prefix of a name that [`Self::parse`] reads.
    pub(crate) fn name_prefix(self, prefix: &str) -> String {
        format!(
            "{prefix}{}-{}-{}-",
            self.pid, self.start_ticks, self.namespace
        )
    }

    /// Is this service certainly dead? Services in other containers, or on a host where `/proc` is hidden, count as alive,
    /// because their state is unknown.
    pub(crate) fn is_dead(self) -> bool {
        let this = Self::this_process();
        let is_known = this.start_ticks != 0 && this.namespace == self.namespace;
        is_known && start_ticks_of(self.pid) != Some(self.start_ticks)
    }
}

/// The id of this process's pid namespace; 0 if unknown.
fn pid_namespace() -> u64 {
    let link = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let digits: String = link
        .to_string_lossy()
        .chars()
        .filter(char::is_ascii_digit)
        .collect();
    digits.parse().unwrap_or(0)
}

/// Start time of process `pid`, in clock ticks since boot; `None` if it does not exist or is dead.
fn start_ticks_of(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in parentheses, may contain anything; the fields after it are plain. The state is the
    // first of them, the start time the 20th.
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
    fn owner_with_a_reused_pid_is_dead() {
        let this = Owner::this_process();
        assert!(!this.is_dead());
        assert!(
            Owner {
                start_ticks: this.start_ticks + 1,
                ..this
            }
            .is_dead()
        );
        assert!(
            Owner {
                pid: u32::MAX,
                ..this
            }
            .is_dead()
        );
    }

    #[test]
    fn owner_in_another_pid_namespace_counts_as_alive() {
        let this = Owner::this_process();
        assert!(
            !Owner {
                start_ticks: this.start_ticks + 1,
                namespace: this.namespace + 1,
                ..this
            }
            .is_dead()
        );
    }

    #[test]
    fn owner_is_parsed_from_its_own_names_only() {
        let this = Owner::this_process();
        assert_eq!(
            Owner::parse(&format!("{}7", this.name_prefix("agent-")), "agent-"),
            Some(this)
        );
        assert_eq!(Owner::parse("agent-12-345", "agent-"), None);
        assert_eq!(Owner::parse("other-12-345-6-0", "agent-"), None);
    }
}

//! The host user of an agent.
//!
//! The *service* is the process that starts agents. If it is unprivileged, they run as its user, confined to a user namespace. A root
//! service must not run agents as root. Two agents must not share what the kernel accounts per user (processes, keys,
//! pipes). So each agent of a root service gets its own user id from a range that distributions leave unused
//! (0x7000_0000 to 0x7fff_ffff, unused according to systemd's list of user ids). It is drawn at random, since the
//! agent can read it in `/proc/self/mountinfo`: a count would show how many agents were started.

use crate::{Layer, SandboxError, error::IoContext};
use rustix::{
    fs, process,
    rand::{GetRandomFlags, getrandom},
    thread,
};

const RANGE_START: u32 = 0x7000_0000;
/// With so many ids, two agents that run at once have the same one with a negligible probability.
const RANGE_MASK: u32 = (1 << 28) - 1;
/// The kernel's id for unmapped users; the fallback in a container that maps few ids.
const OVERFLOW_ID: u32 = 65_534;

/// The host user of one agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AgentUser {
    /// User and group id in the service's own user namespace.
    pub id: u32,
}

impl AgentUser {
    /// A user for the next agent; `None` when the service itself is unprivileged.
    pub(crate) fn for_next_agent() -> Result<Option<Self>, SandboxError> {
        if !process::geteuid().is_root() {
            return Ok(None);
        }
        let mut bytes = [0; 4];
        getrandom(&mut bytes, GetRandomFlags::empty()).context("cannot draw a user id")?;
        let own_id = RANGE_START + (u32::from_ne_bytes(bytes) & RANGE_MASK);
        let maps = [
            read_map("/proc/self/uid_map")?,
            read_map("/proc/self/gid_map")?,
        ];
        [own_id, OVERFLOW_ID]
            .into_iter()
            .find(|&id| maps.iter().all(|map| is_mapped(map, id)))
            .map(|id| Some(Self { id }))
            .ok_or_else(|| SandboxError::Unavailable {
                layer: Layer::Namespaces,
                reason: format!(
                    "the service runs as root of a user namespace that maps neither id {own_id} nor {OVERFLOW_ID}, \
                     so its agents would be root too; run it as an ordinary user, or map more ids"
                ),
            })
    }

    /// Is this process root of the host's first user namespace, and not only of a container's?
    pub(crate) fn is_host_root() -> bool {
        let map = read_map("/proc/self/uid_map").unwrap_or_default();
        process::geteuid().is_root() && map.split_whitespace().eq(["0", "0", "4294967295"])
    }

    /// Switches to this user irrevocably. Called between fork and exec, where only system calls are allowed.
    pub(crate) fn switch_to(self) -> rustix::io::Result<()> {
        let (uid, gid) = (fs::Uid::from_raw(self.id), fs::Gid::from_raw(self.id));
        thread::set_thread_groups(&[])?;
        thread::set_thread_res_gid(gid, gid, gid)?;
        thread::set_thread_res_uid(uid, uid, uid)
    }
}

fn read_map(path: &str) -> Result<String, SandboxError> {
    std::fs::read_to_string(path).context(format_args!("cannot read {path}"))
}

/// `map` is the text of a `uid_map`; its columns are first inside id, first outside id, count.
fn is_mapped(map: &str, id: u32) -> bool {
    map.lines().any(|line| {
        let mut numbers = line.split_whitespace().map(str::parse::<u64>);
        let (Some(Ok(first)), _, Some(Ok(count))) =
            (numbers.next(), numbers.next(), numbers.next())
        else {
            return false;
        };
        (first..first.saturating_add(count)).contains(&u64::from(id))
    })
}

#[cfg(test)]
mod tests {
    use super::is_mapped;

    #[test]
    fn id_map_lookup_respects_its_ranges() {
        let full = "         0          0 4294967295\n";
        let container = "0 1000 1\n1 100000 65536\n";
        assert!(is_mapped(full, 0x7000_0000));
        assert!(!is_mapped(container, 0x7000_0000));
        assert!(is_mapped(container, 65_534));
        assert!(!is_mapped("0 1000 1\n", 65_534));
    }
}

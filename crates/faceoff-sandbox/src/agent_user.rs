//! The host user of an agent.
//!
//! Agents of an unprivileged service run as the service's user, confined to a user namespace. A root service
//! must not run agents as root. Two agents must not share what the kernel accounts per user (processes, keys,
//! pipes). So each agent of a root service gets its own user id from a range that distributions leave unused
//! (0x7000_0000 to 0x7fff_ffff, unused according to systemd's list of user ids).

use crate::{Layer, SandboxError, error::IoContext};
use rustix::{fs, process, thread};
use std::sync::atomic::{AtomicU32, Ordering};

const RANGE_START: u32 = 0x7000_0000;
/// Number of user ids per service process. The pid (22 bits) and the index among these ids (6 bits) fill the range.
const IDS_PER_SERVICE: u32 = 64;
const PID_MASK: u32 = (1 << 22) - 1;
/// The kernel's id for unmapped users; the fallback in a container that maps few ids.
const OVERFLOW_ID: u32 = 65_534;
static NEXT_INDEX: AtomicU32 = AtomicU32::new(0);

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
        let index = NEXT_INDEX.fetch_add(1, Ordering::Relaxed) % IDS_PER_SERVICE;
        let pid = std::process::id() & PID_MASK;
        let own_id = RANGE_START + pid * IDS_PER_SERVICE + index;
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

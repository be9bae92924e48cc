//! Which user an agent is on the host.
//!
//! An ordinary user's agents are that user, confined to a user namespace. A root service must not run
//! agents as root, and two agents should not share what the kernel accounts by user (processes, keys,
//! pipes), so each gets a number of its own from a range that distributions leave unused
//! (0x7000_0000 to 0x7fff_ffff; systemd's list of user ids names it so).

use crate::{Layer, SandboxError, error::IoContext};
use rustix::{fs, process, thread};
use std::sync::atomic::{AtomicU32, Ordering};

const RANGE_START: u32 = 0x7000_0000;
/// Ids per service process: its pid (22 bits) and these 6 bits fill the range.
const SLOTS: u32 = 64;
/// The last resort in a container that maps few ids.
const NOBODY: u32 = 65_534;
static NEXT_SLOT: AtomicU32 = AtomicU32::new(0);

/// The host user that an agent becomes.
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
        let slot = NEXT_SLOT.fetch_add(1, Ordering::Relaxed) % SLOTS;
        let pid = std::process::id() & 0x003f_ffff;
        let own = RANGE_START + pid * SLOTS + slot;
        let maps = [
            read_map("/proc/self/uid_map")?,
            read_map("/proc/self/gid_map")?,
        ];
        [own, NOBODY]
            .into_iter()
            .find(|&id| maps.iter().all(|map| is_mapped(map, id)))
            .map(|id| Some(Self { id }))
            .ok_or_else(|| SandboxError::Unavailable {
                layer: Layer::Namespaces,
                why: format!(
                    "the service runs as root of a user namespace that maps neither id {own} nor {NOBODY}, \
                     so its agents would be root too; run it as an ordinary user, or map more ids"
                ),
            })
    }

    /// Becomes this user for good. Called between fork and exec, where only system calls are allowed.
    pub(crate) fn assume(self) -> rustix::io::Result<()> {
        let (uid, gid) = (fs::Uid::from_raw(self.id), fs::Gid::from_raw(self.id));
        thread::set_thread_groups(&[])?;
        thread::set_thread_res_gid(gid, gid, gid)?;
        thread::set_thread_res_uid(uid, uid, uid)
    }
}

fn read_map(path: &str) -> Result<String, SandboxError> {
    std::fs::read_to_string(path).context(format_args!("cannot read {path}"))
}

/// `map` is the text of a `uid_map`: first inside id, first outside id, count.
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
    fn a_full_map_holds_every_id_and_a_container_map_only_its_own() {
        let full = "         0          0 4294967295\n";
        let container = "0 1000 1\n1 100000 65536\n";
        assert!(is_mapped(full, 0x7000_0000));
        assert!(!is_mapped(container, 0x7000_0000));
        assert!(is_mapped(container, 65_534));
        assert!(!is_mapped("0 1000 1\n", 65_534));
    }
}

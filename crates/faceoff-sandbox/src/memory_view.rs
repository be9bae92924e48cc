//! The memory that an agent sees: as much as it may use, whatever the host has.
//!
//! Runtimes choose the size of their heaps by it: a share of the host's memory would exceed the limit of the agent.

use crate::{Layer, SpawnSpec};

/// Quantities of `/proc/meminfo` that are the agent's memory. Nothing else is in use: the figures never change.
const AGENT_MEMORY: [&str; 4] = ["MemTotal", "MemFree", "MemAvailable", "CommitLimit"];
/// Constants of the processor and the kernel.
const CONSTANTS: [&str; 2] = ["Hugepagesize", "VmallocTotal"];

/// The memory of one agent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MemoryView {
    /// In bytes; `None` if no limit is enforced.
    limit: Option<u64>,
}

impl MemoryView {
    pub(crate) fn new(spec: &SpawnSpec) -> Self {
        let is_limited = spec.isolation.enforces(Layer::CgroupMemory);
        Self {
            limit: is_limited.then_some(spec.limits.memory_bytes),
        }
    }

    /// Memory of the agent on a host with so many bytes; `None` if it is the host's.
    pub(crate) fn bytes(self, host_bytes: u64) -> Option<u64> {
        self.limit.filter(|&limit| limit < host_bytes)
    }

    /// The content of the host's `/proc/meminfo` with the agent's memory, of which all is free.
    pub(crate) fn filter_file(self, content: &[u8]) -> Vec<u8> {
        let text = String::from_utf8_lossy(content);
        let host_kib = text.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            (name == "MemTotal").then(|| kib(value))?
        });
        let Some(bytes) = host_kib.and_then(|kib| self.bytes(kib.saturating_mul(1024))) else {
            return content.to_vec();
        };
        let agent_line = |line: &str| {
            let (name, value) = line.split_once(':')?;
            if CONSTANTS.contains(&name) {
                return None;
            }
            // Numbers of huge pages have no unit.
            let unit = if kib(value).is_some() { " kB" } else { "" };
            let value = if AGENT_MEMORY.contains(&name) {
                bytes / 1024
            } else {
                0
            };
            Some(format!("{:<15} {value:>8}{unit}\n", format!("{name}:")))
        };
        let lines = text
            .lines()
            .map(|line| agent_line(line).unwrap_or_else(|| format!("{line}\n")));
        lines.collect::<String>().into_bytes()
    }
}

/// The number in ` 123 kB`.
fn kib(value: &str) -> Option<u64> {
    value.trim().strip_suffix("kB")?.trim_end().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: &[u8] = b"MemTotal:       24689668 kB\nMemFree:        20000000 kB\nBuffers:          100000 kB\n\
        SwapTotal:       4000000 kB\nVmallocTotal:   34359738367 kB\nHugePages_Total:       5\nHugepagesize:       2048 kB\n";

    fn shown(limit: Option<u64>) -> String {
        String::from_utf8(MemoryView { limit }.filter_file(HOST)).unwrap()
    }

    #[test]
    fn limit_replaces_the_hosts_memory() {
        assert_eq!(
            shown(Some(2 << 30)),
            "MemTotal:        2097152 kB\nMemFree:         2097152 kB\nBuffers:               0 kB\n\
             SwapTotal:             0 kB\nVmallocTotal:   34359738367 kB\nHugePages_Total:        0\nHugepagesize:       2048 kB\n"
        );
    }

    #[test]
    fn host_memory_is_shown_without_a_lower_limit() {
        assert_eq!(shown(None).as_bytes(), HOST);
        assert_eq!(shown(Some(1 << 40)).as_bytes(), HOST);
    }
}

//! The layers of isolation between an agent and the host, and which of them to apply.

use serde::{Deserialize, Serialize};
use std::fmt;

/// One layer between an agent and the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// bubblewrap: no network, own processes, own files, no capabilities.
    Namespaces,
    /// Refuses system calls that an agent does not need.
    Seccomp,
    /// Memory of the whole tree, swap and scratch included.
    CgroupMemory,
    /// Processes and threads of the whole tree.
    CgroupPids,
    /// CPU time of the whole tree.
    CgroupCpu,
    /// Open files, file size, core dumps, locked memory, priorities.
    Rlimits,
}

impl Layer {
    /// All layers, outermost first.
    pub const ALL: [Self; 6] = [
        Self::Namespaces,
        Self::Seccomp,
        Self::CgroupMemory,
        Self::CgroupPids,
        Self::CgroupCpu,
        Self::Rlimits,
    ];

    /// The layer's name in configuration files and messages, e.g. `cgroup-memory`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Namespaces => "namespaces",
            Self::Seccomp => "seccomp",
            Self::CgroupMemory => "cgroup-memory",
            Self::CgroupPids => "cgroup-pids",
            Self::CgroupCpu => "cgroup-cpu",
            Self::Rlimits => "rlimits",
        }
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Which isolation to apply.
#[derive(Debug, Clone, PartialEq)]
pub enum Isolation {
    /// All layers except the disabled ones.
    Sandboxed {
        /// Layers that the organiser has disabled (`sandbox.given_up` in the configuration). Empty: all layers are enforced.
        disabled_layers: Vec<Layer>,
    },
    /// A developer's own agent: no namespaces, no seccomp, no cgroup, no resource limits, and the caller's
    /// environment. Its process group, deadlines, line caps and reaping remain.
    None,
}

impl Isolation {
    /// Is `layer` to be enforced?
    pub fn enforces(&self, layer: Layer) -> bool {
        match self {
            Self::Sandboxed { disabled_layers } => !disabled_layers.contains(&layer),
            Self::None => false,
        }
    }
}

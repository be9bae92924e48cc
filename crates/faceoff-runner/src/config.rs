use faceoff_sandbox::{Isolation, Limits, Runtime};
use faceoff_types::TimeLimits;
use std::collections::BTreeMap;

/// How agents are run on this machine.
#[derive(Debug, Clone)]
pub struct AgentEnvironment {
    /// What the process tree may use.
    pub limits: Limits,
    /// How long it may take.
    pub time: TimeLimits,
    /// What separates it from the host.
    pub isolation: Isolation,
    /// The runtimes that `agent.toml` may name.
    pub runtimes: BTreeMap<String, Runtime>,
    /// Are agents run that are container images (runtime `image`)?
    pub images: bool,
    /// CPUs for the agent; the thread that simulates keeps off them. Empty: no pinning.
    pub agent_cpus: Vec<usize>,
}

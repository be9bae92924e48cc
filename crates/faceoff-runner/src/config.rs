//! The settings under which agents run on this host: limits, isolation, runtimes and CPUs.

use crate::supervisor::Supervision;
use faceoff_episode::Simulator;
use faceoff_sandbox::{Isolation, Layer, Limits, Runtime};
use faceoff_types::{IMAGE_RUNTIME, TimeLimits};
use std::{collections::BTreeMap, sync::Arc};

/// The environment of agents on this host; called `env` in this crate, as opposed to environment *variables*.
#[derive(Debug, Clone)]
pub struct AgentEnvironment {
    /// Resource limits of an agent's process tree.
    pub limits: Limits,
    /// Time limits of an agent's answers.
    pub time: TimeLimits,
    pub isolation: Isolation,
    /// The runtimes that `agent.toml` may name.
    pub runtimes: BTreeMap<String, Runtime>,
    /// May agents be container images (runtime `image`)?
    pub images: bool,
    /// CPUs for the agent; the simulating thread does not use them. Empty: no pinning.
    pub agent_cpus: Vec<usize>,
    /// Kills an agent that blocks its evaluator, or whose job was cancelled.
    pub supervision: Supervision,
    /// The competition, and the worlds in which agents act.
    pub simulator: Arc<dyn Simulator>,
}

impl AgentEnvironment {
    /// Does a cgroup count and limit the agent's CPU time?
    pub(crate) fn has_cpu_accounting(&self) -> bool {
        self.isolation.enforces(Layer::CgroupCpu)
    }

    /// May agents of these two environments run on the same CPU?
    pub(crate) fn share_cpus([first, second]: [&Self; 2]) -> bool {
        first.agent_cpus.is_empty()
            || second.agent_cpus.is_empty()
            || first
                .agent_cpus
                .iter()
                .any(|cpu| second.agent_cpus.contains(cpu))
    }

    /// Can agents be container images on this host? They need the sandbox's namespaces.
    #[must_use]
    pub fn supports_images(&self) -> bool {
        self.images && self.isolation.enforces(Layer::Namespaces)
    }

    /// The runtimes that `agent.toml` may name on this host.
    #[must_use]
    pub fn runtime_names(&self) -> Vec<String> {
        let image = self.supports_images().then(|| IMAGE_RUNTIME.to_owned());
        self.runtimes.keys().cloned().chain(image).collect()
    }
}

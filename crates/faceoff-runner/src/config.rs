use crate::supervisor::Supervision;
use faceoff_sandbox::{Isolation, Layer, Limits, Runtime};
use faceoff_types::{IMAGE_RUNTIME, TimeLimits};
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
    /// May agents be container images (runtime `image`)?
    pub images: bool,
    /// CPUs for the agent; the thread that simulates keeps off them. Empty: no pinning.
    pub agent_cpus: Vec<usize>,
    /// Who ends an agent that holds its evaluator, or whose job was cancelled.
    pub supervision: Supervision,
}

impl AgentEnvironment {
    /// Has the agent a cgroup that counts and limits its CPU time?
    pub(crate) fn counts_cpus(&self) -> bool {
        self.isolation.enforces(Layer::CgroupCpu)
    }

    /// May agents of these two run on the same CPU?
    pub(crate) fn share_cpus([a, b]: [&Self; 2]) -> bool {
        a.agent_cpus.is_empty()
            || b.agent_cpus.is_empty()
            || a.agent_cpus.iter().any(|cpu| b.agent_cpus.contains(cpu))
    }

    /// Are container images run here? They need the sandbox's namespaces.
    #[must_use]
    pub fn runs_images(&self) -> bool {
        self.images && self.isolation.enforces(Layer::Namespaces)
    }

    /// What `agent.toml` may name as its runtime here.
    #[must_use]
    pub fn offered(&self) -> Vec<String> {
        let image = self.runs_images().then(|| IMAGE_RUNTIME.to_owned());
        self.runtimes.keys().cloned().chain(image).collect()
    }
}

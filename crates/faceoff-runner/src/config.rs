use faceoff_sandbox::{Isolation, Limits, Runtime};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, time::Duration};

/// How long an agent may take (PROTOCOL, "Time"), in seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimeLimits {
    /// From the start of the process to its answer to `hello`.
    pub startup_s: f64,
    /// To answer `reset`.
    pub reset_s: f64,
    /// To answer one `step`.
    pub step_s: f64,
    /// To exit after `bye`, or once it has closed its output, before it is killed.
    pub bye_s: f64,
    /// How often an episode is played again because the host stalled, at most; then the last try
    /// counts as it is. 0: never.
    pub host_noise_reruns: u32,
}

impl Default for TimeLimits {
    fn default() -> Self {
        Self {
            startup_s: 120.0,
            reset_s: 10.0,
            step_s: 1.0,
            bye_s: 5.0,
            host_noise_reruns: 2,
        }
    }
}

impl TimeLimits {
    /// A limit as a duration; one that is no sensible number of seconds counts as an hour, so that
    /// a deadline exists whatever a configuration says.
    pub(crate) fn duration(limit_s: f64) -> Duration {
        const HOUR: Duration = Duration::from_secs(3600);
        Duration::try_from_secs_f64(limit_s).map_or(HOUR, |limit| limit.min(HOUR))
    }
}

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
    /// CPUs for the agent; the thread that simulates keeps off them. Empty: no pinning.
    pub agent_cpus: Vec<usize>,
}

//! What an agent may use and how long it may take. Whoever orders a run states them, whoever carries
//! it out enforces them.

use crate::{CONTROL_STEP_S, EPISODE_STEPS};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Everything that an agent is held to.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct AgentLimits {
    /// Of its archive.
    pub bundle: BundleLimits,
    /// Of its process tree.
    pub resources: ResourceLimits,
    /// Of its answers.
    pub time: TimeLimits,
}

/// What a bundle may hold (PROTOCOL, "Bundle").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct BundleLimits {
    /// Largest archive, in bytes.
    pub packed_bytes: u64,
    /// Largest sum of its files, in bytes; of a container image, of its layers' files as they come, and once more of
    /// what all layers hold.
    pub unpacked_bytes: u64,
    /// Most files and links; folders are counted separately, against the same number.
    pub files: u64,
    /// Longest time to unpack it, in seconds. What the other limits let through takes a fraction of it on
    /// any host that works, so whoever meets this one has our fault.
    pub unpack_s: u32,
}

impl Default for BundleLimits {
    fn default() -> Self {
        Self {
            packed_bytes: 512 << 20,
            unpacked_bytes: 2 << 30,
            files: 50_000,
            unpack_s: 600,
        }
    }
}

/// What an agent's process tree may use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ResourceLimits {
    /// Memory of the tree in bytes: anonymous, page cache, scratch files and swap together.
    pub memory_bytes: u64,
    /// Processes and threads alive at a time, the first one included.
    pub pids: u32,
    /// Size of the scratch folder `/tmp` in bytes; shared memory (`/dev/shm`) may be as large again.
    /// Both count as memory too.
    pub scratch_bytes: u64,
    /// Open file descriptors per process.
    pub open_files: u32,
    /// Largest single file in bytes.
    pub file_size_bytes: u64,
    /// CPU time per time: 1.0 = one CPU, enforced every 10 ms by the cgroup's quota.
    pub cpus: f64,
    /// How much of the end of standard error is kept, in bytes.
    pub stderr_tail_bytes: u64,
}

impl Default for ResourceLimits {
    /// Room for a Python agent with a small network on CPU; not for one that trains.
    fn default() -> Self {
        Self {
            memory_bytes: 2 << 30,
            pids: 128,
            scratch_bytes: 256 << 20,
            open_files: 1024,
            file_size_bytes: 256 << 20,
            cpus: 1.0,
            stderr_tail_bytes: 64 << 10,
        }
    }
}

/// How long an agent may take (PROTOCOL, "Time"), in seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TimeLimits {
    /// From the start of the process, once its sandbox stands, to its answer to `hello`.
    pub startup_s: f64,
    /// To answer `reset`.
    pub reset_s: f64,
    /// To answer one `step`.
    pub step_s: f64,
    /// Mean of the answers of a smoke run, for each task.
    pub mean_s: f64,
    /// All answers of an episode: so many times the control time of its steps …
    pub episode_control_times: f64,
    /// … and this much more.
    pub episode_extra_s: f64,
    /// All resets of a shard: this much for each of its episodes …
    pub reset_mean_s: f64,
    /// … and this much more.
    pub resets_extra_s: f64,
    /// To exit after `bye`, or once it has closed its output, before it is killed.
    pub bye_s: f64,
    /// How often an episode is played again because the host kept the agent from answering, at most; then
    /// the last try counts as it is. 0: never.
    pub host_noise_reruns: u32,
    /// How many are played again so, at most, of 100 episodes; of fewer in proportion, rounded up.
    pub host_noise_reruns_per_100: u32,
}

impl Default for TimeLimits {
    fn default() -> Self {
        Self {
            startup_s: 120.0,
            reset_s: 10.0,
            step_s: 1.0,
            mean_s: 0.02,
            episode_control_times: 2.0,
            episode_extra_s: 2.0,
            reset_mean_s: 0.2,
            resets_extra_s: 30.0,
            bye_s: 5.0,
            host_noise_reruns: 2,
            host_noise_reruns_per_100: 5,
        }
    }
}

impl TimeLimits {
    /// No wait for an agent is longer.
    pub const LONGEST: Duration = Duration::from_secs(3600);

    /// The longest that an agent can hold a slot with so many episodes in so many shards, of which it may break
    /// `max_faults` and be started again each time: the sum of all its budgets, seconds. What the host takes is not in it.
    #[must_use]
    pub fn longest_s(&self, episodes: u32, shards: u32, max_faults: u32) -> f64 {
        let process_s = self.startup_s + self.bye_s;
        let control_s = f64::from(EPISODE_STEPS) * CONTROL_STEP_S;
        let episode_s = control_s * self.episode_control_times
            + self.episode_extra_s
            + self.step_s
            + self.reset_mean_s;
        f64::from(shards) * (process_s + self.resets_extra_s + self.reset_s)
            + f64::from(max_faults) * process_s
            + f64::from(episodes) * episode_s
    }

    /// How many of so many episodes may be played again because of the host.
    #[must_use]
    pub fn host_noise_reruns_of(&self, episodes: u32) -> u32 {
        let reruns =
            (u64::from(episodes) * u64::from(self.host_noise_reruns_per_100)).div_ceil(100);
        u32::try_from(reruns).unwrap_or(u32::MAX)
    }

    /// A limit as a duration; one that is no sensible number of seconds counts as an hour, so that
    /// a deadline exists whatever a configuration says.
    #[must_use]
    pub fn duration(limit_s: f64) -> Duration {
        let given = Duration::try_from_secs_f64(limit_s);
        given.map_or(Self::LONGEST, |limit| limit.min(Self::LONGEST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_shard_is_the_one_that_the_handbook_tells() {
        // docs/operating.md: 11 × 125 + 50 + 50 × 23 = 2575 s
        let longest_s = TimeLimits::default().longest_s(50, 1, 10);
        assert!((longest_s - 2575.0).abs() < 1e-9, "{longest_s}");
    }
}

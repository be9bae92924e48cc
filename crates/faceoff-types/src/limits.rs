//! Limits of an agent's resources and times. They are part of each job; the *slot*, the place in a worker that runs the
//! job, enforces them.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// All limits of an agent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct AgentLimits {
    /// Limits of its bundle, the archive with its files.
    pub bundle: BundleLimits,
    /// Limits of its process tree.
    pub resources: ResourceLimits,
    /// Limits of its answers.
    pub time: TimeLimits,
}

/// Limits of a bundle (docs/protocol.md, "A bundle").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct BundleLimits {
    /// Largest archive, in bytes.
    pub packed_bytes: u64,
    /// Largest total size of its files, in bytes. For a container image it applies twice: to the files of all
    /// layers together, and to the merged file system.
    pub unpacked_bytes: u64,
    /// Most files and links; folders are counted separately, against the same number.
    pub files: u64,
    /// Longest time to unpack it, in seconds. A bundle within the other limits needs a fraction of it on a
    /// healthy host, so exceeding it is a platform fault.
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

/// Resource limits of an agent's process tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ResourceLimits {
    /// Memory of the tree in bytes: anonymous memory, page cache, scratch files and swap together.
    pub memory_bytes: u64,
    /// Processes and threads alive at a time, including the first.
    pub pids: u32,
    /// Size of the scratch folder `/tmp` in bytes; shared memory (`/dev/shm`) has the same limit.
    /// Both also count as memory.
    pub scratch_bytes: u64,
    /// Open file descriptors per process.
    pub open_files: u32,
    /// Largest single file that the agent writes, in bytes.
    pub file_size_bytes: u64,
    /// CPUs: seconds of CPU time per second, enforced every 10 ms by the cgroup's quota.
    pub cpus: f64,
    /// Size of the stored part of standard error, in bytes: its beginning and its end.
    #[serde(rename = "stderr_tail_bytes")]
    pub stderr_kept_bytes: u64,
}

impl Default for ResourceLimits {
    /// Enough for a Python agent with a small network on CPU, but not for training.
    fn default() -> Self {
        Self {
            memory_bytes: 2 << 30,
            pids: 128,
            scratch_bytes: 256 << 20,
            open_files: 1024,
            file_size_bytes: 256 << 20,
            cpus: 1.0,
            stderr_kept_bytes: 64 << 10,
        }
    }
}

/// How long an agent may take (docs/protocol.md, "Time"), in seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TimeLimits {
    /// From the start of the process in its finished sandbox to its answer to `hello`.
    pub startup_s: f64,
    /// To answer `reset`.
    pub reset_s: f64,
    /// To answer one `step`.
    pub step_s: f64,
    /// Largest mean answer time per task in a validation run, which checks an upload. A slower agent makes the submission invalid.
    pub mean_s: f64,
    /// Budget for the answers of an episode: this factor times the control time of its steps …
    #[serde(rename = "episode_control_times")]
    pub episode_control_time_factor: f64,
    /// … plus this time.
    pub episode_extra_s: f64,
    /// Budget for the resets of a shard: this time per episode …
    pub reset_mean_s: f64,
    /// … plus this time.
    pub resets_extra_s: f64,
    /// Grace period to exit after `bye`, or after closing its output, before it is killed.
    pub bye_s: f64,
    /// Maximum number of repetitions of an episode because of host interference (other load of the machine delayed the agent's
    /// answers); then the last try counts. 0: never repeated.
    #[serde(rename = "host_noise_reruns")]
    pub host_interference_reruns: u32,
    /// Maximum number of such repetitions per 100 episodes; for other numbers in proportion, rounded up.
    #[serde(rename = "host_noise_reruns_per_100")]
    pub host_interference_reruns_per_100: u32,
}

impl Default for TimeLimits {
    fn default() -> Self {
        Self {
            startup_s: 120.0,
            reset_s: 10.0,
            step_s: 1.0,
            mean_s: 0.02,
            episode_control_time_factor: 2.0,
            episode_extra_s: 2.0,
            reset_mean_s: 0.2,
            resets_extra_s: 30.0,
            bye_s: 5.0,
            host_interference_reruns: 2,
            host_interference_reruns_per_100: 5,
        }
    }
}

impl TimeLimits {
    /// Upper bound of every wait for an agent.
    pub const MAX_WAIT: Duration = Duration::from_secs(3600);

    /// The longest time for which an agent can occupy a slot, in seconds: the sum of its budgets for `episodes` episodes of at most
    /// `longest_episode_s` (simulated time) in `shards` shards, with a restart after each of `max_faults` faults. Host interference
    /// comes on top.
    #[must_use]
    pub fn max_slot_time_s(
        &self,
        longest_episode_s: f64,
        episodes: u32,
        shards: u32,
        max_faults: u32,
    ) -> f64 {
        let process_s = self.startup_s + self.bye_s;
        let episode_s = longest_episode_s * self.episode_control_time_factor
            + self.episode_extra_s
            + self.step_s
            + self.reset_mean_s;
        f64::from(shards) * (process_s + self.resets_extra_s + self.reset_s)
            + f64::from(max_faults) * process_s
            + f64::from(episodes) * episode_s
    }

    /// Allowed repetitions because of host interference in a run of `episodes` episodes.
    #[must_use]
    pub fn max_host_interference_reruns(&self, episodes: u32) -> u32 {
        let reruns =
            (u64::from(episodes) * u64::from(self.host_interference_reruns_per_100)).div_ceil(100);
        u32::try_from(reruns).unwrap_or(u32::MAX)
    }

    /// A limit as a duration. A limit that is not a valid duration counts as one hour, so that a deadline exists
    /// whatever the configuration says.
    #[must_use]
    pub fn duration(limit_s: f64) -> Duration {
        let limit = Duration::try_from_secs_f64(limit_s);
        limit.map_or(Self::MAX_WAIT, |limit| limit.min(Self::MAX_WAIT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_shard_is_as_documented() {
        // From docs/monitoring.md: 11 processes × 125 s + 50 s for resets + 50 episodes × 23 s.
        const DOCUMENTED_S: f64 = 2575.0;
        let (episodes, shards, max_faults) = (50, 1, 10);
        let longest_s = TimeLimits::default().max_slot_time_s(10.0, episodes, shards, max_faults);
        assert!((longest_s - DOCUMENTED_S).abs() < 1e-9, "{longest_s}");
    }
}

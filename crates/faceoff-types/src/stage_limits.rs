//! The limits of agents and the upload quotas that a stage may set in place of the server's.

use crate::AgentLimits;
use serde::{Deserialize, Serialize};

/// Limits of agents in a stage that replace those of the server's configuration. An absent limit is the server's.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct StageLimits {
    /// Memory of an agent's process tree in bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_bytes: Option<u64>,
    /// Maximum number of processes and threads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pids: Option<u32>,
    /// Size of the scratch folder in bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scratch_bytes: Option<u64>,
    /// CPUs: seconds of CPU time per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpus: Option<f64>,
    /// Seconds from the start of the process to its answer to `hello`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub startup_s: Option<f64>,
    /// Seconds to answer `reset`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reset_s: Option<f64>,
    /// Seconds to answer one `step`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Largest mean answer time per task in a validation run, in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_s: Option<f64>,
    /// Budget for the answers of an episode: this factor times the control time of its steps …
    #[serde(
        rename = "episode_control_times",
        skip_serializing_if = "Option::is_none"
    )]
    pub episode_control_time_factor: Option<f64>,
    /// … plus this time, in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episode_extra_s: Option<f64>,
    /// Budget for the resets of a shard: this time per episode, in seconds …
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reset_mean_s: Option<f64>,
    /// … plus this time, in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resets_extra_s: Option<f64>,
}

/// A limit or quota out of range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct InvalidLimit {
    field: &'static str,
    expected: String,
    got: String,
}

impl StageLimits {
    /// Are all values those of the server's configuration?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that all limits are in range.
    ///
    /// # Errors
    /// The first limit that is out of range.
    pub fn check(&self) -> Result<(), InvalidLimit> {
        for (field, value, least) in [
            ("memory_bytes", self.memory_bytes, 16 << 20),
            ("pids", self.pids.map(u64::from), 2),
            ("scratch_bytes", self.scratch_bytes, 0),
        ] {
            if let Some(value) = value.filter(|value| *value < least) {
                return Err(InvalidLimit {
                    field,
                    expected: format!("at least {least}"),
                    got: value.to_string(),
                });
            }
        }
        for (field, value, least, most) in [
            ("cpus", self.cpus, 0.01, 1024.0),
            ("startup_s", self.startup_s, 0.001, 3600.0),
            ("reset_s", self.reset_s, 0.001, 3600.0),
            ("step_s", self.step_s, 0.001, 3600.0),
            ("mean_s", self.mean_s, 0.001, 3600.0),
            (
                "episode_control_times",
                self.episode_control_time_factor,
                0.001,
                3600.0,
            ),
            ("episode_extra_s", self.episode_extra_s, 0.001, 3600.0),
            ("reset_mean_s", self.reset_mean_s, 0.001, 3600.0),
            ("resets_extra_s", self.resets_extra_s, 0.001, 3600.0),
        ] {
            if let Some(value) = value.filter(|value| !(least..=most).contains(value)) {
                return Err(InvalidLimit {
                    field,
                    expected: format!("{least} to {most}"),
                    got: value.to_string(),
                });
            }
        }
        Ok(())
    }

    /// The server's limits with these replacing their counterparts.
    #[must_use]
    pub fn apply_to(&self, server: &AgentLimits) -> AgentLimits {
        let mut limits = server.clone();
        let (resources, time) = (&mut limits.resources, &mut limits.time);
        replace(&mut resources.memory_bytes, self.memory_bytes);
        replace(&mut resources.pids, self.pids);
        replace(&mut resources.scratch_bytes, self.scratch_bytes);
        replace(&mut resources.cpus, self.cpus);
        replace(&mut time.startup_s, self.startup_s);
        replace(&mut time.reset_s, self.reset_s);
        replace(&mut time.step_s, self.step_s);
        replace(&mut time.mean_s, self.mean_s);
        replace(
            &mut time.episode_control_time_factor,
            self.episode_control_time_factor,
        );
        replace(&mut time.episode_extra_s, self.episode_extra_s);
        replace(&mut time.reset_mean_s, self.reset_mean_s);
        replace(&mut time.resets_extra_s, self.resets_extra_s);
        limits
    }
}

fn replace<T>(limit: &mut T, stage_limit: Option<T>) {
    if let Some(stage_limit) = stage_limit {
        *limit = stage_limit;
    }
}

/// Upload quotas of each team while the stage is current; they replace those of the server's configuration. An absent
/// quota is the server's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct StageUploadLimits {
    /// Submissions pending validation; at least 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waiting: Option<u32>,
    /// Bytes per UTC day; at least 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub day_bytes: Option<u64>,
    /// Bytes of stored bundles; at least 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stored_bytes: Option<u64>,
}

impl StageUploadLimits {
    /// Are all values those of the server's configuration?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that uploads are possible.
    ///
    /// # Errors
    /// The first quota of 0.
    pub fn check(&self) -> Result<(), InvalidLimit> {
        for (field, value) in [
            ("waiting", self.waiting.map(u64::from)),
            ("day_bytes", self.day_bytes),
            ("stored_bytes", self.stored_bytes),
        ] {
            if value == Some(0) {
                return Err(InvalidLimit {
                    field,
                    expected: "at least 1".to_owned(),
                    got: "0".to_owned(),
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stage_limits_replace_only_their_counterparts() {
        let none: StageLimits = serde_json::from_str("{}").unwrap();
        assert!(none.is_empty());
        assert_eq!(serde_json::to_string(&none).unwrap(), "{}");
        let server = AgentLimits::default();
        assert_eq!(none.apply_to(&server), server);
        let limits: StageLimits =
            serde_json::from_str(r#"{"memory_bytes":33554432,"step_s":0.5}"#).unwrap();
        assert_eq!(limits.check(), Ok(()));
        let mut expected = server.clone();
        expected.resources.memory_bytes = 32 << 20;
        expected.time.step_s = 0.5;
        assert_eq!(limits.apply_to(&server), expected);
    }

    #[test]
    fn limit_out_of_range_is_refused_by_name() {
        for (json, words) in [
            (
                r#"{"memory_bytes":10}"#,
                "memory_bytes: expected at least 16777216, got 10",
            ),
            (r#"{"pids":1}"#, "pids: expected at least 2, got 1"),
            (r#"{"cpus":0.0}"#, "cpus: expected 0.01 to 1024, got 0"),
            (r#"{"step_s":-1.0}"#, "step_s"),
            (r#"{"startup_s":3601.0}"#, "startup_s"),
        ] {
            let limits: StageLimits = serde_json::from_str(json).unwrap();
            let error = limits.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(serde_json::from_str::<StageLimits>(r#"{"memory":1}"#).is_err());
        let no_uploads: StageUploadLimits = serde_json::from_str(r#"{"waiting":0}"#).unwrap();
        assert!(
            no_uploads
                .check()
                .unwrap_err()
                .to_string()
                .contains("waiting: expected at least 1")
        );
        assert_eq!(StageUploadLimits::default().check(), Ok(()));
    }
}

//! Ablations: what each perturbation of the simulator (such as noise) costs an agent.

use crate::views::evaluation::Progress;
use faceoff_scoring::ProfileEffect;
use faceoff_types::{SubmissionId, Task};
use indexmap::IndexMap;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An ablation: a submission evaluated without perturbations, with each perturbation alone, and with all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AblationView {
    /// The evaluated submission.
    pub submission: SubmissionId,
    /// Episodes per task in each profile.
    pub episodes_per_task: u32,
    /// When the ablation was requested.
    pub created_at: Timestamp,
    /// Its state, with the results.
    #[serde(flatten)]
    pub status: AblationStatus,
}

/// State of an ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum AblationStatus {
    /// Waiting behind evaluations that count, or running.
    #[serde(rename = "open")]
    Unfinished {
        /// Episodes done and in total, over all profiles and tasks.
        progress: Progress,
    },
    /// All profiles are evaluated.
    Finished {
        /// When the last episode was stored.
        finished_at: Timestamp,
        /// By task: one entry per profile, `ideal` first.
        tasks: IndexMap<Task, Vec<ProfileEffect>>,
    },
    /// Ended without a result.
    Failed {
        /// When the failed run was stored.
        finished_at: Timestamp,
        /// The fault, and whether the agent or the platform caused it.
        reason: String,
    },
}

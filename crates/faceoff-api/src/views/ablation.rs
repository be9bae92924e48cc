//! What each perturbation costs an agent.

use crate::views::evaluation::Progress;
use faceoff_scoring::ProfileEffect;
use faceoff_types::{SubmissionId, Task};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// An ablation of a submission: its agent under each perturbation alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AblationView {
    /// The submission that plays.
    pub submission: SubmissionId,
    /// Episodes of each task in each profile.
    pub episodes_per_task: u32,
    /// When it was ordered.
    pub created_at: Timestamp,
    /// What has become of it.
    #[serde(flatten)]
    pub status: AblationStatus,
}

/// What has become of an ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum AblationStatus {
    /// It waits behind what counts, or is being played.
    Open {
        /// Over all profiles and tasks.
        progress: Progress,
    },
    /// All profiles are played.
    Finished {
        /// When the last episode was stored.
        finished_at: Timestamp,
        /// By task: one entry per profile, `ideal` first.
        tasks: BTreeMap<Task, Vec<ProfileEffect>>,
    },
    /// It ended without a result.
    Failed {
        /// When the run that failed was stored.
        finished_at: Timestamp,
        /// Whose fault it was, and which.
        reason: String,
    },
}

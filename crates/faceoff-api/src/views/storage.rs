//! How much room a team's files take, and how much of that counts towards its quota.

use faceoff_types::{TeamId, TeamName};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The room that the files of a team take.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StorageView {
    /// Whose.
    pub team: TeamId,
    /// Its name.
    pub team_name: TeamName,
    /// Archives of submissions that are kept.
    pub archives: u32,
    /// Of these; what counts towards the quota.
    pub archive_bytes: u64,
    /// How much the archives may have, by the stage that matters now or the server's configuration.
    pub quota_bytes: u64,
    /// Datasets of evaluations that are kept; for the team, of released days and of no blind stage.
    pub datasets: u32,
    /// Of these, as far as they were measured.
    pub dataset_bytes: u64,
    /// Datasets among them that nobody has measured yet; the server does, within minutes.
    pub unmeasured_datasets: u32,
    /// Datasets of trials and proposals; for the organiser alone, absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proposal_bytes: Option<u64>,
}

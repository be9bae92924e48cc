//! Disk usage and quota of teams.

use faceoff_types::{TeamId, TeamName, deprecated_names};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Disk usage of a team's files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct StorageView {
    /// Id of the team.
    pub team: TeamId,
    /// Name of the team.
    pub team_name: TeamName,
    /// Number of stored bundles.
    pub bundles: u32,
    /// Bytes of stored bundles, which count towards the quota.
    pub bundle_bytes: u64,
    /// Quota of stored bundles in bytes, from the current stage or the server's configuration.
    pub quota_bytes: u64,
    /// Number of stored datasets; for the team, only of released days and of stages that are not blind.
    pub datasets: u32,
    /// Bytes of these datasets, as far as they are measured.
    pub dataset_bytes: u64,
    /// Number of these datasets whose size is not measured yet; the server measures them within minutes.
    pub unmeasured_datasets: u32,
    /// Bytes of datasets of trials and proposals; for organisers only, absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proposal_bytes: Option<u64>,
}
deprecated_names!(StorageView { archives => bundles, archive_bytes => bundle_bytes });

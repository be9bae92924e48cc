//! How much room a team's files take, and how much of that counts towards its quota.

use super::stage;
use crate::{app::AppState, problem::Problem};
use faceoff_store::{Counted, TeamStorage};
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

impl StorageView {
    fn new(storage: TeamStorage, quota_bytes: u64, counted: Counted) -> Self {
        Self {
            team: storage.team,
            team_name: storage.name,
            archives: storage.archives,
            archive_bytes: storage.archive_bytes,
            quota_bytes,
            datasets: storage.datasets,
            dataset_bytes: storage.dataset_bytes,
            unmeasured_datasets: storage.unmeasured,
            proposal_bytes: (counted == Counted::All).then_some(storage.draft_bytes),
        }
    }

    /// Of all teams by name, for an organiser.
    pub(crate) async fn all(app: &AppState) -> Result<Vec<Self>, Problem> {
        Self::of(app, None, Counted::All).await
    }

    /// Of one team, for itself or for an organiser.
    pub(crate) async fn find(
        app: &AppState,
        team: TeamId,
        counted: Counted,
    ) -> Result<Self, Problem> {
        let found = Self::of(app, Some(team), counted).await?;
        let found = found.into_iter().next();
        found.ok_or_else(|| Problem::not_found("team"))
    }

    async fn of(
        app: &AppState,
        team: Option<TeamId>,
        counted: Counted,
    ) -> Result<Vec<Self>, Problem> {
        let own = stage::current(app).await?.settings.uploads;
        let configured = app.config.limits.upload_quota.stored_bytes;
        let quota = own.stored_bytes.unwrap_or(configured);
        let storage = app.store.storage(team, counted).await?.into_iter();
        Ok(storage
            .map(|storage| Self::new(storage, quota, counted))
            .collect())
    }
}

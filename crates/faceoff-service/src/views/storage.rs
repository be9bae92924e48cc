//! How much room a team's files take, and how much of that counts towards its quota.

use crate::{app::AppState, boxed, problem::Problem, views::stage};
use faceoff_api::views::storage::StorageView;
use faceoff_store::{Counted, TeamStorage};
use faceoff_types::TeamId;

fn view(storage: TeamStorage, quota_bytes: u64, counted: Counted) -> StorageView {
    StorageView {
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
#[boxed]
pub async fn all(app: &AppState) -> Result<Vec<StorageView>, Problem> {
    of(app, None, Counted::All).await
}

/// Of one team, for itself or for an organiser.
#[boxed]
pub async fn find(app: &AppState, team: TeamId, counted: Counted) -> Result<StorageView, Problem> {
    let found = of(app, Some(team), counted).await?;
    let found = found.into_iter().next();
    found.ok_or_else(|| Problem::not_found("team"))
}

async fn of(
    app: &AppState,
    team: Option<TeamId>,
    counted: Counted,
) -> Result<Vec<StorageView>, Problem> {
    let own = stage::current(app).await?.settings.uploads;
    let configured = app.config.limits.upload_quota.stored_bytes;
    let quota = own.stored_bytes.unwrap_or(configured);
    let storage = app.store.storage(team, counted).await?.into_iter();
    Ok(storage
        .map(|storage| view(storage, quota, counted))
        .collect())
}

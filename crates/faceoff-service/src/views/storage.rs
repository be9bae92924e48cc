//! Disk usage and quota of teams.

use crate::{app::AppState, boxed, problem::Problem, views::stage};
use faceoff_api::views::storage::StorageView;
use faceoff_store::{StorageScope, TeamStorage};
use faceoff_types::TeamId;

fn view(storage: TeamStorage, quota_bytes: u64, counted: StorageScope) -> StorageView {
    StorageView {
        team: storage.team,
        team_name: storage.name,
        bundles: storage.bundles,
        bundle_bytes: storage.bundle_bytes,
        quota_bytes,
        datasets: storage.datasets,
        dataset_bytes: storage.dataset_bytes,
        unmeasured_datasets: storage.unmeasured,
        proposal_bytes: (counted == StorageScope::All).then_some(storage.proposal_bytes),
    }
}

/// Disk usage of all teams by name, for organisers.
#[boxed]
pub async fn all(app: &AppState) -> Result<Vec<StorageView>, Problem> {
    usage(app, None, StorageScope::All).await
}

/// Disk usage of a team, for itself or for organisers.
#[boxed]
pub async fn find(
    app: &AppState,
    team: TeamId,
    counted: StorageScope,
) -> Result<StorageView, Problem> {
    let found = usage(app, Some(team), counted).await?;
    let found = found.into_iter().next();
    found.ok_or_else(|| Problem::not_found("team"))
}

async fn usage(
    app: &AppState,
    team: Option<TeamId>,
    counted: StorageScope,
) -> Result<Vec<StorageView>, Problem> {
    let own = stage::current(app).await?.settings.uploads;
    let configured = app.config.limits.upload_quota.stored_bytes;
    let quota = own.stored_bytes.unwrap_or(configured);
    let storage = app.store.storage(team, counted).await?.into_iter();
    Ok(storage
        .map(|storage| view(storage, quota, counted))
        .collect())
}

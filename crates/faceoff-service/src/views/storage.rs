//! Disk usage of teams, and their quota of stored bundles.

use crate::{app::AppState, boxed_future, problem::Problem, views::stage};
use faceoff_api::views::storage::StorageView;
use faceoff_store::{StorageScope, TeamStorage};
use faceoff_types::TeamId;

fn view(storage: TeamStorage, quota_bytes: u64, scope: StorageScope) -> StorageView {
    StorageView {
        team: storage.team,
        team_name: storage.name,
        bundles: storage.bundles,
        bundle_bytes: storage.bundle_bytes,
        quota_bytes,
        datasets: storage.datasets,
        dataset_bytes: storage.dataset_bytes,
        unmeasured_datasets: storage.unmeasured,
        proposal_bytes: (scope == StorageScope::All).then_some(storage.proposal_bytes),
    }
}

/// Disk usage of all teams by name, for organisers.
#[boxed_future]
pub async fn all(app: &AppState) -> Result<Vec<StorageView>, Problem> {
    usage(app, None, StorageScope::All).await
}

/// Disk usage of a team, for the team itself or for organisers. `scope` says whether proposed re-evaluations count.
#[boxed_future]
pub async fn find(
    app: &AppState,
    team: TeamId,
    scope: StorageScope,
) -> Result<StorageView, Problem> {
    let usage = usage(app, Some(team), scope).await?;
    let team_usage = usage.into_iter().next();
    team_usage.ok_or_else(|| Problem::not_found("team"))
}

/// Disk usage of one team, or of all (`None`), by name.
async fn usage(
    app: &AppState,
    team: Option<TeamId>,
    scope: StorageScope,
) -> Result<Vec<StorageView>, Problem> {
    let stage_limits = stage::current(app).await?.settings.uploads;
    let configured_bytes = app.config.limits.upload_quota.stored_bytes;
    let quota_bytes = stage_limits.stored_bytes.unwrap_or(configured_bytes);
    let storage = app.store.storage(team, scope).await?.into_iter();
    Ok(storage
        .map(|storage| view(storage, quota_bytes, scope))
        .collect())
}

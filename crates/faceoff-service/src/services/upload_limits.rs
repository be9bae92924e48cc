//! What a team may upload: the limits of the current stage or of the server's configuration.

use super::bundle_stream::{self, SizeLimit};
use crate::{
    app::App,
    problem::{Problem, ProblemKind},
    upload_slots::UploadSlot,
    views::stage,
};
use faceoff_store::{StoreError, UploadQuota, UploadUsage};
use faceoff_types::TeamId;
use jiff::Timestamp;

/// Upload limits of a team, from the current stage or the server's configuration.
#[derive(Clone, Copy)]
pub(super) struct UploadLimits {
    /// Largest number of submissions that wait for their validation run.
    max_pending: usize,
    pub(super) quota: UploadQuota,
}

impl UploadLimits {
    pub(super) async fn current(app: &App) -> Result<Self, Problem> {
        let limits = &app.config.limits;
        let stage_limits = stage::current(app).await?.settings.uploads;
        let quota = limits.upload_quota;
        Ok(Self {
            max_pending: stage_limits
                .waiting
                .map_or(limits.pending_submissions, |waiting| waiting as usize),
            quota: UploadQuota {
                day_bytes: stage_limits.day_bytes.unwrap_or(quota.day_bytes),
                stored_bytes: stage_limits.stored_bytes.unwrap_or(quota.stored_bytes),
            },
        })
    }
}

/// The size limit of a bundle: the limit for all teams, or the rest of the team's quota if that is less.
pub(super) fn size_limit(
    app: &App,
    quota: UploadQuota,
    usage: UploadUsage,
    now: Timestamp,
) -> SizeLimit {
    let max_bundle_bytes = app.config.max_bundle_bytes;
    let left_bytes = quota.remaining(usage);
    SizeLimit {
        max_bytes: left_bytes.min(max_bundle_bytes),
        make_problem: Box::new(move |announced_bytes| {
            let bytes = announced_bytes.unwrap_or(left_bytes.saturating_add(1));
            match quota.check(usage, bytes) {
                Err(error) if left_bytes < max_bundle_bytes => {
                    Problem::with_quota_reset(error, now)
                }
                _ => bundle_stream::too_large(max_bundle_bytes, announced_bytes),
            }
        }),
    }
}

/// A slot of the team for the duration of an upload.
///
/// # Errors
/// `TooManyUploads`.
pub(super) fn acquire_slot(app: &App, team: TeamId) -> Result<UploadSlot, Problem> {
    app.upload_slots.acquire(team).ok_or_else(|| {
        let limit = app.config.limits.team_uploads;
        Problem::new(
            ProblemKind::TooManyUploads,
            format!("{limit} uploads of your team are running already; wait until one has ended"),
        )
        .with("limit", limit)
    })
}

/// Whether the team may upload a bundle now. The store checks this, too, but only after the transfer.
///
/// # Errors
/// `SeasonClosed` or `TooManyPending`.
pub(super) async fn check_may_upload(
    app: &App,
    team: TeamId,
    limits: &UploadLimits,
) -> Result<(), Problem> {
    if let Some(closed_at) = app.store.season().await?.closed_at {
        return Err(StoreError::SeasonClosed { closed_at }.into());
    }
    let pending = app
        .store
        .submissions_of(team)
        .await?
        .iter()
        .filter(|submission| !submission.state.validation_is_over())
        .count();
    if pending >= limits.max_pending {
        return Err(Problem::new(
            ProblemKind::TooManyPending,
            format!(
                "{pending} submissions of your team are waiting for their validation run already; wait until one has \
                 its verdict (GET /api/v1/submissions)"
            ),
        ));
    }
    Ok(())
}

//! Uploads of submissions.

use super::bundle_stream::{self, ReceivedBundle, SizeLimit};
use crate::{
    app::App,
    auth::TeamCaller,
    boxed, free_space,
    problem::{Problem, ProblemKind},
    upload_slots::UploadSlot,
    views::stage,
};
use axum::body::Body;
use faceoff_store::{Actor, StoreError, Submission, Team, UploadQuota, UploadUsage};
use faceoff_types::{ArchiveFormat, BundleRef};
use jiff::Timestamp;
use std::sync::Arc;
use uuid::Uuid;

/// A bundle that is being uploaded.
pub struct IncomingBundle {
    /// Announced number of bytes (`Content-Length`).
    pub bytes: Option<u64>,
    /// File name from the client; not yet sanitised.
    pub claimed_name: String,
    /// The bundle.
    pub body: Body,
}

/// Receives a bundle, creates the submission and queues its validation run.
#[boxed]
pub async fn upload(
    app: &App,
    caller: &TeamCaller,
    incoming: IncomingBundle,
) -> Result<Submission, Problem> {
    let (team, actor) = (caller.team.clone(), caller.actor());
    if let Err(refused) = free_space::check(app) {
        bundle_stream::discard(incoming.body, app.config.limits.min_upload_rate).await;
        return Err(refused);
    }
    let slot = app.upload_slots.acquire(team.id).ok_or_else(|| {
        let limit = app.config.limits.team_uploads;
        Problem::new(
            ProblemKind::TooManyUploads,
            format!("{limit} uploads of your team are running already; wait until one has ended"),
        )
        .with("limit", limit)
    })?;
    // Checked before the bundle is transferred in vain; the store checks it again.
    if let Some(closed_at) = app.store.season().await?.closed_at {
        return Err(StoreError::SeasonClosed { closed_at }.into());
    }
    let limits = UploadLimits::current(app).await?;
    let pending = app
        .store
        .submissions_of(team.id)
        .await?
        .iter()
        .filter(|submission| !submission.state.is_checked())
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

    let now = app.config.clock.now();
    let used = app.store.upload_usage(team.id, now).await?;
    let received = bundle_stream::receive(
        incoming.body,
        incoming.bytes,
        &app.config.upload_dir,
        &size_limit(app, limits.quota, used, now),
        app.config.limits.min_upload_rate,
    )
    .await?;
    // If the client disconnects, this handler is dropped. A separate task stores the received bundle nevertheless.
    let stored = tokio::spawn(store(
        Arc::clone(app),
        (team, actor),
        received,
        incoming.claimed_name,
        slot,
    ));
    stored.await.map_err(Problem::internal)?
}

/// Upload limits of a team, from the current stage or the server's configuration.
#[derive(Clone, Copy)]
struct UploadLimits {
    /// Submissions that may wait for their validation run.
    max_pending: usize,
    quota: UploadQuota,
}

impl UploadLimits {
    async fn current(app: &App) -> Result<Self, Problem> {
        let limits = &app.config.limits;
        let own = stage::current(app).await?.settings.uploads;
        let quota = limits.upload_quota;
        Ok(Self {
            max_pending: own
                .waiting
                .map_or(limits.pending_submissions, |waiting| waiting as usize),
            quota: UploadQuota {
                day_bytes: own.day_bytes.unwrap_or(quota.day_bytes),
                stored_bytes: own.stored_bytes.unwrap_or(quota.stored_bytes),
            },
        })
    }
}

/// The limit for any bundle, or the rest of the team's quota if that is less.
fn size_limit(app: &App, quota: UploadQuota, used: UploadUsage, now: Timestamp) -> SizeLimit {
    let largest = app.config.max_bundle_bytes;
    let left = quota.remaining(used);
    SizeLimit {
        max_bytes: left.min(largest),
        exceeded: Box::new(move |announced| {
            let bytes = announced.unwrap_or(left.saturating_add(1));
            match quota.check(used, bytes) {
                Err(spent) if left < largest => Problem::with_quota_reset(spent, now),
                _ => bundle_stream::too_large(largest, announced),
            }
        }),
    }
}

/// Stores a received bundle and creates its submission.
async fn store(
    app: App,
    (team, actor): (Team, Actor),
    received: ReceivedBundle,
    claimed_name: String,
    _slot: UploadSlot,
) -> Result<Submission, Problem> {
    let bundle = BundleRef {
        key: format!(
            "bundles/{}/{}.{}",
            team.id,
            Uuid::now_v7(),
            received.format.extension()
        ),
        bytes: received.bytes,
        blake3: received.blake3.to_string(),
        file_name: file_name(&claimed_name, received.format),
    };
    let _permit = app
        .artifact_writes
        .acquire()
        .await
        .map_err(Problem::internal)?;
    let artifacts = app.store.artifacts();
    artifacts
        .put_file(&bundle.key, received.file.path())
        .await?;
    let key = bundle.key.clone();
    let now = app.config.clock.now();
    let quota = UploadLimits::current(&app).await?.quota;
    let created = app
        .store
        .create_submission(actor, team.id, bundle, &quota, now)
        .await;
    match created {
        Ok(submission) => {
            tracing::info!(team = %team.name, submission = %submission.id, bytes = received.bytes, "uploaded");
            Ok(submission)
        }
        Err(error) => {
            if let Err(failure) = artifacts.delete(&key).await {
                tracing::warn!(key, %failure, "an artifact without a submission could not be deleted");
            }
            Err(Problem::with_quota_reset(error, now))
        }
    }
}

/// A safe file name with an extension of the bundle's format, from the claimed one.
fn file_name(claimed: &str, format: ArchiveFormat) -> String {
    let last = claimed.rsplit(['/', '\\']).next().unwrap_or_default();
    let safe: String = last
        .chars()
        .filter(|c| c.is_alphanumeric() || "._-".contains(*c))
        .take(80)
        .collect();
    let stem = safe.trim_start_matches('.');
    if stem.is_empty() {
        format!("agent.{}", format.extension())
    } else if format
        .names()
        .iter()
        .any(|end| stem.to_lowercase().ends_with(end))
    {
        stem.to_owned()
    } else {
        format!("{stem}.{}", format.extension())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_name_is_safe_and_matches_format() {
        let gz = |claimed| file_name(claimed, ArchiveFormat::TarGz);
        assert_eq!(gz("striker.tar.gz"), "striker.tar.gz");
        assert_eq!(gz("striker.tgz"), "striker.tgz");
        assert_eq!(gz("../../etc/passwd"), "passwd.tar.gz");
        assert_eq!(gz("C:\\agents\\a b.zip"), "ab.zip.tar.gz");
        assert_eq!(gz(""), "agent.tar.gz");
        assert_eq!(gz(".."), "agent.tar.gz");
        assert_eq!(file_name("x", ArchiveFormat::Zip), "x.zip");
        assert_eq!(file_name("ours.tar", ArchiveFormat::Tar), "ours.tar");
        assert!(gz(&"a".repeat(500)).len() < 100);
    }
}

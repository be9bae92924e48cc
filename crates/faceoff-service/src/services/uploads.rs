//! Uploads of submissions: a team sends a *bundle* (archive file or container image with its agent), and a validation run checks it.

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
    /// Number of bytes that the client has announced (`Content-Length`).
    pub bytes: Option<u64>,
    /// File name from the client; not yet sanitised.
    pub claimed_name: String,
    /// The bundle's bytes.
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
    free_space::check(app)?;
    let slot = app.upload_slots.acquire(team.id).ok_or_else(|| {
        let limit = app.config.limits.team_uploads;
        Problem::new(
            ProblemKind::TooManyUploads,
            format!("{limit} uploads of your team are running already; wait until one has ended"),
        )
        .with("limit", limit)
    })?;
    // The store checks this, too, but only after the transfer.
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
    let usage = app.store.upload_usage(team.id, now).await?;
    let received = bundle_stream::receive(
        incoming.body,
        incoming.bytes,
        &app.config.upload_dir,
        &size_limit(app, limits.quota, usage, now),
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
    /// Largest number of submissions that wait for their validation run.
    max_pending: usize,
    quota: UploadQuota,
}

impl UploadLimits {
    async fn current(app: &App) -> Result<Self, Problem> {
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
fn size_limit(app: &App, quota: UploadQuota, usage: UploadUsage, now: Timestamp) -> SizeLimit {
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
    /// Longest name that is kept.
    const MAX_CHARS: usize = 80;
    let last_component = claimed.rsplit(['/', '\\']).next().unwrap_or_default();
    let safe: String = last_component
        .chars()
        .filter(|c| c.is_alphanumeric() || "._-".contains(*c))
        .take(MAX_CHARS)
        .collect();
    let stem = safe.trim_start_matches('.');
    if stem.is_empty() {
        format!("agent.{}", format.extension())
    } else if format
        .names()
        .iter()
        .any(|extension| stem.to_lowercase().ends_with(extension))
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
        let tar_gz_name = |claimed| file_name(claimed, ArchiveFormat::TarGz);
        assert_eq!(tar_gz_name("striker.tar.gz"), "striker.tar.gz");
        assert_eq!(tar_gz_name("striker.tgz"), "striker.tgz");
        assert_eq!(tar_gz_name("../../etc/passwd"), "passwd.tar.gz");
        assert_eq!(tar_gz_name("C:\\agents\\a b.zip"), "ab.zip.tar.gz");
        assert_eq!(tar_gz_name(""), "agent.tar.gz");
        assert_eq!(tar_gz_name(".."), "agent.tar.gz");
        assert_eq!(file_name("x", ArchiveFormat::Zip), "x.zip");
        assert_eq!(file_name("ours.tar", ArchiveFormat::Tar), "ours.tar");
        assert!(tar_gz_name(&"a".repeat(500)).len() < 100);
    }
}

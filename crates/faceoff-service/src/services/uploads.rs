//! Uploads of submissions: a team sends a *bundle* (archive file or container image with its agent), and a validation run checks it.

use super::{
    bundle_stream::{self, ReceivedBundle, SizeLimit},
    partial_uploads::{self, UploadGuards},
    upload_limits::{UploadLimits, acquire_slot, check_may_upload, size_limit},
};
use crate::{app::App, auth::TeamCaller, boxed_future, free_space, problem::Problem};
use axum::body::Body;
use faceoff_store::{Actor, StoreError, Submission, Team};
use faceoff_types::{ArchiveFormat, BundleRef, IdempotencyKey, TeamId};
use std::sync::Arc;
use unicode_normalization::{UnicodeNormalization, char::is_combining_mark};
use uuid::Uuid;

/// A bundle that is being uploaded.
pub struct IncomingBundle {
    /// File name from the client; not yet sanitised.
    pub claimed_name: String,
    /// Identifies the upload, so that it can be sent again without creating a second submission.
    pub key: Option<IdempotencyKey>,
    pub source: BundleSource,
}

/// Where a bundle comes from.
pub enum BundleSource {
    /// The request's body.
    Body {
        /// Number of bytes that the client has announced (`Content-Length`).
        bytes: Option<u64>,
        body: Body,
    },
    /// The parts that were uploaded before, of a bundle with this hash.
    Parts(blake3::Hash),
}

/// Receives a bundle, creates the submission and queues its validation run. If a bundle with the same key was uploaded before, it
/// returns that submission.
#[boxed_future]
pub async fn upload(
    app: &App,
    caller: &TeamCaller,
    incoming: IncomingBundle,
) -> Result<Submission, Problem> {
    let team = caller.team.id;
    free_space::check(app)?;
    let (received, guards) = match incoming.source {
        BundleSource::Body { bytes, body } => {
            let earlier = earlier_upload(app, team, incoming.key.as_ref()).await?;
            let slot = acquire_slot(app, team)?;
            let received = receive(app, team, (bytes, body), earlier.as_ref()).await?;
            if let Some(earlier) = earlier {
                return same_bundle(earlier, &received.blake3);
            }
            (received, (slot, None))
        }
        BundleSource::Parts(hash) => {
            let lock = partial_uploads::take_over(app, team, hash).await;
            // Read under the lock: an earlier request with this key may just have made the submission.
            if let Some(earlier) = earlier_upload(app, team, incoming.key.as_ref()).await? {
                return same_bundle(earlier, &hash);
            }
            let slot = acquire_slot(app, team)?;
            check_may_upload(app, team, &UploadLimits::current(app).await?).await?;
            partial_uploads::complete(app, team, hash, (slot, Some(lock))).await?
        }
    };
    // If the client disconnects, this handler is dropped. A separate task stores the received bundle nevertheless.
    let stored = tokio::spawn(store(
        Arc::clone(app),
        (caller.team.clone(), caller.actor()),
        received,
        (incoming.claimed_name, incoming.key),
        guards,
    ));
    stored.await.map_err(Problem::internal)?
}

/// The submission that the team has uploaded with this key.
async fn earlier_upload(
    app: &App,
    team: TeamId,
    key: Option<&IdempotencyKey>,
) -> Result<Option<Submission>, Problem> {
    match key {
        Some(key) => Ok(app.store.uploaded_with_key(team, key).await?),
        None => Ok(None),
    }
}

/// The submission that was uploaded with the same key, if its bundle is the same.
fn same_bundle(earlier: Submission, received: &blake3::Hash) -> Result<Submission, Problem> {
    if earlier.bundle.blake3 == received.to_string() {
        return Ok(earlier);
    }
    Err(StoreError::IdempotencyKeyUsed {
        submission: earlier.id,
    }
    .into())
}

/// Receives the body of an upload. With an `earlier` upload with the same key, it only has to be compared.
async fn receive(
    app: &App,
    team: TeamId,
    (bytes, body): (Option<u64>, Body),
    earlier: Option<&Submission>,
) -> Result<ReceivedBundle, Problem> {
    let limit = match earlier {
        Some(_) => SizeLimit {
            max_bytes: app.config.max_bundle_bytes,
            make_problem: Box::new({
                let max_bytes = app.config.max_bundle_bytes;
                move |announced| bundle_stream::too_large(max_bytes, announced)
            }),
        },
        None => {
            let limits = UploadLimits::current(app).await?;
            check_may_upload(app, team, &limits).await?;
            let now = app.config.clock.now();
            let usage = app.store.upload_usage(team, now).await?;
            size_limit(app, limits.quota, usage, now)
        }
    };
    let (dir, rate) = (&app.config.upload_dir, app.config.limits.min_upload_rate);
    bundle_stream::receive(body, bytes, dir, &limit, rate).await
}

/// Stores a received bundle and creates its submission.
async fn store(
    app: App,
    (team, actor): (Team, Actor),
    received: ReceivedBundle,
    (claimed_name, key): (String, Option<IdempotencyKey>),
    _guards: UploadGuards,
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
    let quota = UploadLimits::current(&app).await?.quota;
    let _permit = app
        .artifact_writes
        .acquire()
        .await
        .map_err(Problem::internal)?;
    let artifacts = app.store.artifacts();
    artifacts.put_file(&bundle.key, &received.file).await?;
    let artifact = bundle.key.clone();
    let now = app.config.clock.now();
    let created = app
        .store
        .create_submission_once(actor, team.id, bundle, key.as_ref(), &quota, now)
        .await;
    if !matches!(&created, Ok(submission) if submission.bundle.key == artifact)
        && let Err(failure) = artifacts.delete(&artifact).await
    {
        tracing::warn!(artifact, %failure, "an artifact without a submission could not be deleted");
    }
    match created {
        Ok(submission) => {
            tracing::info!(team = %team.name, submission = %submission.id, bytes = received.bytes, "uploaded");
            // The file of an upload in parts was kept until now, so that the client need not send it again after an error.
            if let Err(failure) = received.remove() {
                tracing::warn!(%failure, "an uploaded file could not be removed");
            }
            Ok(submission)
        }
        Err(error) => Err(Problem::with_quota_reset(error, now)),
    }
}

/// A safe file name with an extension of the bundle's format, from the claimed one.
fn file_name(claimed: &str, format: ArchiveFormat) -> String {
    /// Longest name that is kept.
    const MAX_CHARS: usize = 80;
    let last_component = claimed.rsplit(['/', '\\']).next().unwrap_or_default();
    // macOS writes “é” as a letter and an accent.
    let safe: String = last_component
        .nfc()
        .filter(|c| c.is_alphanumeric() || is_combining_mark(*c) || "._-".contains(*c))
        .take(MAX_CHARS)
        .collect();
    let stem = safe.trim_start_matches('.');
    if stem.is_empty() {
        format!("agent.{}", format.extension())
    } else if format
        .accepted_extensions()
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
        assert_eq!(tar_gz_name("Zoe\u{308}.tar.gz"), "Zoë.tar.gz");
        assert_eq!(tar_gz_name("हिन्दी.tar.gz"), "हिन्दी.tar.gz");
        assert_eq!(tar_gz_name(""), "agent.tar.gz");
        assert_eq!(tar_gz_name(".."), "agent.tar.gz");
        assert_eq!(file_name("x", ArchiveFormat::Zip), "x.zip");
        assert_eq!(file_name("ours.tar", ArchiveFormat::Tar), "ours.tar");
        assert!(tar_gz_name(&"a".repeat(500)).len() < 100);
    }
}

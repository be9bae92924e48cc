//! Taking an agent in.

use super::bundle_stream::{self, Allowance, Uploaded};
use crate::{
    app::App,
    auth::TeamCaller,
    boxed,
    problem::{Problem, ProblemKind},
    room,
    uploads::Place,
    views::stage,
};
use axum::body::Body;
use faceoff_store::{Actor, StoreError, Submission, Team, UploadQuota, UploadUsage};
use faceoff_types::{ArchiveFormat, BundleRef};
use jiff::Timestamp;
use std::sync::Arc;
use uuid::Uuid;

/// An archive on its way.
pub struct Incoming {
    /// How many bytes it has, where that was announced.
    pub bytes: Option<u64>,
    /// What its sender calls it.
    pub claimed_name: String,
    /// Its bytes.
    pub body: Body,
}

/// Makes a submission of what comes; its smoke run is queued with it.
#[boxed]
pub async fn upload(
    app: &App,
    caller: &TeamCaller,
    incoming: Incoming,
) -> Result<Submission, Problem> {
    let (team, actor) = (caller.team.clone(), caller.actor());
    if let Err(refused) = room::check(app) {
        bundle_stream::discard(incoming.body, app.config.limits.upload_rate).await;
        return Err(refused);
    }
    let place = app.uploads.enter(team.id).ok_or_else(|| {
        let most = app.config.limits.team_uploads;
        Problem::new(
            ProblemKind::TooManyUploads,
            format!("{most} uploads of your team are under way already; wait until one has ended"),
        )
        .with("limit", most)
    })?;
    // before the bundle travels in vain; the store looks again
    if let Some(closed_at) = app.store.season().await?.closed_at {
        return Err(StoreError::SeasonClosed { closed_at }.into());
    }
    let may = May::now(app).await?;
    let pending = app
        .store
        .submissions_of(team.id)
        .await?
        .iter()
        .filter(|submission| !submission.state.is_settled())
        .count();
    if pending >= may.wait {
        return Err(Problem::new(
            ProblemKind::TooManyPending,
            format!(
                "{pending} uploads of your team wait for their smoke run already; wait until one has \
                 its verdict (GET /api/v1/submissions)"
            ),
        ));
    }

    let now = app.config.clock.now();
    let used = app.store.upload_usage(team.id, now).await?;
    let uploaded = bundle_stream::receive(
        incoming.body,
        incoming.bytes,
        &app.config.upload_dir,
        &allowance(app, may.quota, used, now),
        app.config.limits.upload_rate,
    )
    .await?;
    // A client that goes away ends this handler; what is on disk is brought to its end all the same.
    let stored = tokio::spawn(store(
        Arc::clone(app),
        (team, actor),
        uploaded,
        incoming.claimed_name,
        place,
    ));
    stored.await.map_err(Problem::internal)?
}

/// What a team may upload: as the server's configuration has it, or the stage that matters now.
#[derive(Clone, Copy)]
struct May {
    /// Uploads that wait for their smoke run.
    wait: usize,
    quota: UploadQuota,
}

impl May {
    async fn now(app: &App) -> Result<Self, Problem> {
        let limits = &app.config.limits;
        let own = stage::current(app).await?.settings.uploads;
        let quota = limits.upload_quota;
        Ok(Self {
            wait: own
                .waiting
                .map_or(limits.pending_submissions, |waiting| waiting as usize),
            quota: UploadQuota {
                day_bytes: own.day_bytes.unwrap_or(quota.day_bytes),
                stored_bytes: own.stored_bytes.unwrap_or(quota.stored_bytes),
            },
        })
    }
}

/// What a bundle may have: as much as any, or what is left of the team's quota.
fn allowance(app: &App, quota: UploadQuota, used: UploadUsage, now: Timestamp) -> Allowance {
    let largest = app.config.max_bundle_bytes;
    let left = quota.left(used);
    Allowance {
        max_bytes: left.min(largest),
        beyond: Box::new(move |announced| {
            let bytes = announced.unwrap_or(left.saturating_add(1));
            match quota.check(used, bytes) {
                Err(spent) if left < largest => Problem::of_day(spent, now),
                _ => bundle_stream::too_large(largest, announced),
            }
        }),
    }
}

/// Makes a submission of what came.
async fn store(
    app: App,
    (team, actor): (Team, Actor),
    uploaded: Uploaded,
    claimed_name: String,
    _place: Place,
) -> Result<Submission, Problem> {
    let bundle = BundleRef {
        key: format!(
            "bundles/{}/{}.{}",
            team.id,
            Uuid::now_v7(),
            uploaded.format.extension()
        ),
        bytes: uploaded.bytes,
        blake3: uploaded.blake3.to_string(),
        file_name: file_name(&claimed_name, uploaded.format),
    };
    let _storing = app.storing.acquire().await.map_err(Problem::internal)?;
    let artifacts = app.store.artifacts();
    artifacts
        .put_file(&bundle.key, uploaded.file.path())
        .await?;
    let key = bundle.key.clone();
    let now = app.config.clock.now();
    let quota = May::now(&app).await?.quota;
    let created = app
        .store
        .create_submission(actor, team.id, bundle, &quota, now)
        .await;
    match created {
        Ok(submission) => {
            tracing::info!(team = %team.name, submission = %submission.id, bytes = uploaded.bytes, "uploaded");
            Ok(submission)
        }
        Err(error) => {
            if let Err(left) = artifacts.delete(&key).await {
                tracing::warn!(key, %left, "an artifact without a submission is left behind");
            }
            Err(Problem::of_day(error, now))
        }
    }
}

/// A harmless name that ends as the archive's format does, whatever was claimed.
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
    fn a_file_name_is_harmless_and_ends_as_its_format_does() {
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

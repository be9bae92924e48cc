//! Uploading an agent.

use super::{
    bundle_stream::{self, Allowance, Uploaded},
    document::Binary,
};
use crate::{
    app::App,
    auth::TeamCaller,
    extract::QueryParams,
    paths,
    problem::{Problem, ProblemKind},
    room,
    uploads::Place,
    views::{stage, submission::SubmissionView},
};
use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_store::{Actor, StoreError, Submission, Team, UploadQuota, UploadUsage};
use faceoff_types::{ArchiveFormat, BundleRef};
use jiff::Timestamp;
use serde::Deserialize;
use utoipa::IntoParams;
use uuid::Uuid;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct UploadQuery {
    /// Name of the archive, e.g. `striker.tar.gz`; shown with the submission.
    file_name: Option<String>,
}

/// Another place for the archive's name, for clients that cannot set a query.
const FILE_NAME: HeaderName = HeaderName::from_static("x-file-name");

/// Media types that an archive may claim; none at all is fine too.
const ARCHIVE_TYPES: [&str; 8] = [
    "application/octet-stream",
    "application/gzip",
    "application/x-gzip",
    "application/x-gtar",
    "application/x-tar",
    "application/zstd",
    "application/zip",
    "application/x-zip-compressed",
];

/// Uploads a bundle: the request's body is the archive itself (.tar.gz, .tar.zst or .zip).
///
/// It is unpacked and started in a smoke run; follow the submission until it is `valid` or `invalid`.
#[utoipa::path(
    post, path = "/submissions", tag = "team", security(("team" = [])),
    params(
        UploadQuery,
        ("X-File-Name" = Option<String>, Header, description = "another place for the archive's name", example = "striker.tar.gz"),
    ),
    request_body(
        description = "the archive itself",
        content(
            (inline(Binary) = "application/octet-stream"),
            (inline(Binary) = "application/gzip"),
            (inline(Binary) = "application/x-gzip"),
            (inline(Binary) = "application/x-gtar"),
            (inline(Binary) = "application/x-tar"),
            (inline(Binary) = "application/zstd"),
            (inline(Binary) = "application/zip"),
            (inline(Binary) = "application/x-zip-compressed"),
        )
    ),
    responses(
        (status = 201, body = SubmissionView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 408, description = "the body stalled, or came too slowly"),
        (status = 409, description = "the season is closed, or the team's storage is full"),
        (status = 413, description = "larger than max_bundle_bytes"),
        (status = 415, description = "not one of the archive formats"),
        (status = 429, description = "several uploads are under way or wait for their smoke run, or the day's quota is spent"),
        (status = 507, description = "the server's disk has too little room"),
    )
)]
pub(crate) async fn create_submission(
    caller: TeamCaller,
    State(app): State<App>,
    QueryParams(query): QueryParams<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Result<impl IntoResponse, Problem> {
    let (team, actor) = (caller.team.clone(), caller.actor());
    check_media_type(&headers)?;
    if let Err(refused) = room::check(&app) {
        bundle_stream::discard(body, app.config.limits.upload_rate).await;
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
    let may = May::now(&app).await?;
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
    let claimed_name = query
        .file_name
        .or_else(|| Some(headers.get(FILE_NAME)?.to_str().ok()?.to_owned()))
        .unwrap_or_default();
    let uploaded = bundle_stream::receive(
        body,
        headers.get(header::CONTENT_LENGTH),
        &app.config.upload_dir,
        &allowance(&app, may.quota, used, now),
        app.config.limits.upload_rate,
    )
    .await?;
    // A client that goes away ends this handler; what is on disk is brought to its end all the same.
    let stored = tokio::spawn(store(app, (team, actor), uploaded, claimed_name, place));
    let submission = stored.await.map_err(Problem::internal)??;
    let location = [(header::LOCATION, paths::submission(submission.id))];
    let view = SubmissionView::new(submission, None, &[], now);
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
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

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(value) = headers.get(header::CONTENT_TYPE) else {
        return Ok(());
    };
    let text = value.to_str().unwrap_or("(not text)");
    let essence = text
        .split(';')
        .next()
        .unwrap_or_default()
        .trim()
        .to_ascii_lowercase();
    if ARCHIVE_TYPES.contains(&essence.as_str()) {
        return Ok(());
    }
    Err(Problem::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "expected the archive itself as the body, with “Content-Type: application/octet-stream”; \
             got {text:?}. With curl: --data-binary @agent.tar.gz -H 'Content-Type: \
             application/octet-stream'"
        ),
    ))
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
        assert!(gz(&"a".repeat(500)).len() < 100);
    }
}

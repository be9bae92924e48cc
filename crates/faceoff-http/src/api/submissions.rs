//! Submissions: uploading an agent, following its smoke run, using the day's turn for it.

use super::{
    evaluations::{EvaluationView, with_name},
    schema::ProblemBody,
    upload,
};
use crate::{
    App,
    auth::{Caller, TeamCaller},
    extract::{PathParam, QueryParams},
    problem::{Problem, ProblemKind},
};
use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_store::{Actor, StoreError, Submission, SubmissionState};
use faceoff_types::{ArchiveFormat, BundleRef, SubmissionId, TeamId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

/// One uploaded agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SubmissionView {
    /// Its id.
    #[schema(value_type = String, format = Uuid)]
    pub id: SubmissionId,
    /// Its team.
    #[schema(value_type = String, format = Uuid)]
    pub team: TeamId,
    /// Name of the archive.
    pub file_name: String,
    /// Size of the archive in bytes.
    pub bytes: u64,
    /// BLAKE3 of the archive, 64 hexadecimal digits.
    pub blake3: String,
    /// When it came.
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Timestamp,
    /// The agent's own name, known once the bundle was unpacked.
    pub agent_name: Option<String>,
    /// What has become of it.
    #[serde(flatten)]
    pub status: SubmissionStatus,
}

/// What has become of a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum SubmissionStatus {
    /// It waits for its smoke run, or is in it.
    Validating,
    /// It starts, answers and keeps time: it can be evaluated.
    Valid {
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// Something is wrong with it.
    Invalid {
        /// What.
        reason: String,
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// The smoke run failed by our fault, several times; upload it again.
    ValidationError {
        /// What failed.
        reason: String,
    },
}

impl SubmissionView {
    /// `log` is read by itself, where one submission is shown.
    fn new(submission: Submission, log: Option<String>) -> Self {
        Self {
            id: submission.id,
            team: submission.team,
            file_name: submission.bundle.file_name,
            bytes: submission.bundle.bytes,
            blake3: submission.bundle.blake3,
            created_at: submission.created_at,
            agent_name: submission.agent_name,
            status: match submission.state {
                SubmissionState::Validating => SubmissionStatus::Validating,
                SubmissionState::Valid => SubmissionStatus::Valid { log },
                SubmissionState::Invalid { reason } => SubmissionStatus::Invalid { reason, log },
                SubmissionState::ValidationError { reason } => {
                    SubmissionStatus::ValidationError { reason }
                }
            },
        }
    }
}

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
    post, path = "/submissions", tag = "team", security(("team" = [])), params(UploadQuery),
    request_body(content = Vec<u8>, content_type = "application/octet-stream"),
    responses(
        (status = 201, body = SubmissionView),
        (status = 409, description = "the season is closed", body = ProblemBody, content_type = "application/problem+json"),
        (status = 413, description = "larger than max_bundle_bytes", body = ProblemBody, content_type = "application/problem+json"),
        (status = 415, description = "not one of the archive formats", body = ProblemBody, content_type = "application/problem+json"),
        (status = 429, description = "several uploads wait for their smoke run", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn create_submission(
    TeamCaller(team): TeamCaller,
    State(app): State<App>,
    QueryParams(query): QueryParams<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Result<impl IntoResponse, Problem> {
    check_media_type(&headers)?;
    let _slot = app.uploads.try_acquire().map_err(|_| {
        Problem::new(
            ProblemKind::Busy,
            "the server takes as many uploads as it may at once; try again in 2 s",
        )
    })?;
    // before the bundle travels in vain; the store looks again
    if let Some(closed_at) = app.store.season().await?.closed_at {
        return Err(StoreError::SeasonClosed { closed_at }.into());
    }
    let limits = &app.config.limits;
    let pending = app
        .store
        .submissions_of(team.id)
        .await?
        .iter()
        .filter(|submission| !submission.state.is_settled())
        .count();
    if pending >= limits.pending_submissions {
        return Err(Problem::new(
            ProblemKind::TooManyPending,
            format!(
                "{pending} uploads of your team wait for their smoke run already; wait until one has \
                 its verdict (GET /api/v1/submissions)"
            ),
        ));
    }

    let claimed_name = query
        .file_name
        .or_else(|| Some(headers.get(FILE_NAME)?.to_str().ok()?.to_owned()))
        .unwrap_or_default();
    let uploaded = upload::receive(
        body,
        headers.get(header::CONTENT_LENGTH),
        &app.config.upload_dir,
        app.config.max_bundle_bytes,
        limits.upload_pause,
    )
    .await?;
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
    app.store
        .artifacts()
        .put_file(&bundle.key, uploaded.file.path())
        .await?;
    let key = bundle.key.clone();
    let submission = match app
        .store
        .create_submission(
            Actor::Team(team.id),
            team.id,
            bundle,
            app.config.clock.now(),
        )
        .await
    {
        Ok(submission) => submission,
        Err(error) => {
            if let Err(left) = app.store.artifacts().delete(&key).await {
                tracing::warn!(key, %left, "an artifact without a submission is left behind");
            }
            return Err(error.into());
        }
    };
    tracing::info!(team = %team.name, submission = %submission.id, bytes = uploaded.bytes, "uploaded");
    let location = format!("{}/submissions/{}", super::BASE, submission.id);
    let location = HeaderValue::try_from(location).map_err(Problem::internal)?;
    Ok((
        StatusCode::CREATED,
        AppendHeaders([(header::LOCATION, location)]),
        Json(SubmissionView::new(submission, None)),
    ))
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

/// The calling team's submissions, newest first.
#[utoipa::path(
    get, path = "/submissions", tag = "team", security(("team" = [])),
    responses((status = 200, body = Vec<SubmissionView>))
)]
pub(crate) async fn list_submissions(
    TeamCaller(team): TeamCaller,
    State(app): State<App>,
) -> Result<Json<Vec<SubmissionView>>, Problem> {
    let submissions = app.store.submissions_of(team.id).await?;
    Ok(Json(
        submissions
            .into_iter()
            .map(|submission| SubmissionView::new(submission, None))
            .collect(),
    ))
}

/// One submission with its verdict: the reason and the agent's log.
#[utoipa::path(
    get, path = "/submissions/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let submission = visible(&app, &caller, id).await?;
    let log = app.store.submission_log(id).await?;
    Ok(Json(SubmissionView::new(submission, log)))
}

/// Uses the team's turn of today for this submission.
#[utoipa::path(
    post, path = "/submissions/{id}/evaluations", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 201, body = EvaluationView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
        (status = 409, description = "the turn is used, the submission is not valid or came after the release of the day's seed, or the season is closed", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn evaluate_submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<impl IntoResponse, Problem> {
    visible(&app, &caller, id).await?;
    let evaluation = app
        .store
        .create_evaluation(caller.actor(), id, &app.config.plan, app.config.clock.now())
        .await?;
    let view = with_name(&app, evaluation).await?;
    tracing::info!(team = %view.team_name, evaluation = %view.id, "evaluation queued");
    let location = format!("{}/evaluations/{}", super::BASE, view.id);
    let location = HeaderValue::try_from(location).map_err(Problem::internal)?;
    Ok((
        StatusCode::CREATED,
        AppendHeaders([(header::LOCATION, location)]),
        Json(view),
    ))
}

/// The submission, if the caller may see it; another team's looks like none at all.
pub(super) async fn visible(
    app: &App,
    caller: &Caller,
    id: SubmissionId,
) -> Result<Submission, Problem> {
    let submission = app.store.submission(id).await?;
    if caller.may_see(submission.team) {
        Ok(submission)
    } else {
        Err(Problem::not_found("submission"))
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

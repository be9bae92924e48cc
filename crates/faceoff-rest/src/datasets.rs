//! Datasets, the recordings of evaluations: downloading and publishing them, links to them, and their list of violated
//! constraints.

use super::{
    document::{Binary, FileHeaders, IfNoneMatchHeader},
    downloads::{Download, download, file_stem, send_tagged},
    proposals,
    stored_dataset::StoredDataset,
};
use crate::download_links::{self, LinkOr, LinkQuery};
use axum::{
    Json,
    extract::State,
    http::StatusCode,
    response::{IntoResponse, Response},
};
use faceoff_api::{
    paths,
    requests::NewLink,
    views::{evaluation::EvaluationView, link::LinkView, violations::ViolationsView},
};
use faceoff_service::{
    app::App,
    archive_contents,
    auth::{Caller, TeamCaller},
    day_release::check_released,
    extract::{OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::{evaluation, violations, visibility::Visibility},
};
use faceoff_store::{EvaluationState, StoreError};
use faceoff_types::EvaluationId;

/// Downloads the recorded dataset, a zip file. For its team and organisers, and for everyone once it is public.
///
/// It contains the day's seed, so it is available once the day is released. Datasets of trials and proposals that are
/// not applied are for organisers only.
#[utoipa::path(
    get, path = "/evaluations/{id}/dataset", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 403, description = "the link is invalid"),
        (status = 404),
        (status = 409, description = "the evaluation has not finished or has failed, its day is not released, or its stage hides results (blind)"),
        (status = 410, description = "the dataset was removed, by a retention rule or with its proposal; the detail says when and why; or the link has expired"),
    )
)]
pub(crate) async fn dataset(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let stored = find_dataset(viewer, &app, id).await?;
    let team = app.store.team(stored.team).await?;
    let file = Download {
        key: &stored.dataset,
        blake3: stored.blake3.as_deref(),
        media_type: "application/zip",
        name: &format!(
            "faceoff-{}-{}.zip",
            file_stem(team.name.as_str()),
            stored.day
        ),
    };
    match download(&app, &conditions, file).await {
        Err(StoreError::NotFound(_)) => {
            // The dataset may have been removed meanwhile. Otherwise the file is lost.
            if proposals::dataset(viewer, &app, id).await?.is_none() {
                find_released(viewer, &app, id).await?;
            }
            Err(Problem::internal(format_args!("{} is lost", file.key)))
        }
        result => Ok(result?),
    }
}

/// Creates a link that downloads the dataset without a token for a limited time. For callers who may download it now.
///
/// Permissions are checked when the link is used, as for its creator: it becomes invalid with the creator's token, and
/// gives no access to anything that was hidden or removed meanwhile.
#[utoipa::path(
    post, path = "/evaluations/{id}/dataset/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "the evaluation has not finished or has failed, its day is not released, or its stage hides results (blind)"),
        (status = 410, description = "the dataset was removed"),
        (status = 422),
    )
)]
pub(crate) async fn link_dataset(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    OptionalJson(request): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    find_dataset(Viewer::new(&caller), &app, id).await?;
    let path = format!("{}/dataset", paths::evaluation(id));
    download_links::link(&app, &caller, &path, request).await
}

/// Returns the violated constraints and the slow answers by episode: the dataset's `violations.json`. Needs access to
/// the dataset.
///
/// A slow answer states its computation time, the part of it that the host caused, and the agent's CPU time.
#[utoipa::path(
    get, path = "/evaluations/{id}/violations", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), IfNoneMatchHeader),
    responses(
        (status = 200, body = ViolationsView),
        (status = 404),
        (status = 409, description = "the evaluation has not finished or has failed, its day is not released, or its stage hides results (blind)"),
        (status = 410, description = "the dataset was removed; the detail says when and by which retention rule"),
    )
)]
pub(crate) async fn violations(
    viewer: Viewer,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let stored = find_released(viewer, &app, id).await?;
    // The response depends on the dataset and on the server's version.
    let source = stored.blake3.as_deref().unwrap_or(&stored.dataset);
    let tag = ETag::new("violations", &[source, env!("CARGO_PKG_VERSION")]);
    let violations = async {
        let view = violations::read(&app, &stored.dataset).await?;
        Ok(Json(view).into_response())
    };
    send_tagged(&tag, &conditions, violations).await
}

/// Publishes a finished evaluation of the calling team and its dataset, before the stage publishes them. Everyone can then
/// read both without a token. This cannot be undone.
#[utoipa::path(
    post, path = "/evaluations/{id}/publish", tag = "team", security(("team" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "the evaluation has not finished, its day is not released, its stage hides results (blind), or its boards are frozen before its result"),
    )
)]
pub(crate) async fn publish_evaluation(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Json<EvaluationView>, Problem> {
    let team = &caller.team;
    let visibility = Visibility::load(&app, Viewer::Team(team.id)).await?;
    let evaluation = visibility.readable(app.store.evaluation(id).await)?;
    if evaluation.team != team.id {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "the evaluation belongs to another team, and is public already",
        ));
    }
    visibility.check_not_blind(evaluation.stage_day.stage)?;
    if let EvaluationState::Finished { .. } = &evaluation.state {
        check_released(&app, &evaluation).await?;
        visibility.check_not_frozen(&evaluation, "published")?;
    }
    let now = app.config.clock.now();
    let published = app
        .store
        .publish_evaluation(caller.actor(), id, now)
        .await?;
    tracing::info!(evaluation = %id, team = %team.name, "evaluation published by its team");
    evaluation::build(&app, &visibility, published)
        .await
        .map(Json)
}

/// The dataset of an evaluation, if the viewer may download it now.
async fn find_dataset(
    viewer: Viewer,
    app: &App,
    id: EvaluationId,
) -> Result<StoredDataset, Problem> {
    match proposals::dataset(viewer, app, id).await? {
        Some(proposed) => {
            archive_contents::check_included(app, &proposed.dataset, "dataset").await?;
            Ok(proposed)
        }
        None => find_released(viewer, app, id).await,
    }
}

/// The dataset of a finished evaluation whose day is released.
async fn find_released(
    viewer: Viewer,
    app: &App,
    id: EvaluationId,
) -> Result<StoredDataset, Problem> {
    let visibility = Visibility::load(app, viewer).await?;
    let evaluation = visibility.readable(app.store.evaluation(id).await)?;
    visibility.check_not_blind(evaluation.stage_day.stage)?;
    let no_dataset_reason = match &evaluation.state {
        EvaluationState::Finished {
            dataset,
            dataset_blake3,
            ..
        } => {
            check_released(app, &evaluation).await?;
            let exists = app.store.artifacts().size_bytes(dataset).await?.is_some();
            // The file of a removed dataset may be kept as evidence, say of a disqualified team: organisers can download it then.
            if let Some(removed) = &evaluation.dataset_removed
                && !(viewer == Viewer::Organiser && exists)
            {
                return Err(Problem::removed("the dataset", removed));
            }
            archive_contents::check_included(app, dataset, "dataset").await?;
            return Ok(StoredDataset {
                team: evaluation.team,
                day: evaluation.stage_day.date,
                dataset: dataset.clone(),
                blake3: dataset_blake3.clone(),
            });
        }
        EvaluationState::Queued | EvaluationState::Running { .. } | EvaluationState::Scoring => {
            "the evaluation has not finished; poll it until its state is “finished”"
        }
        EvaluationState::AgentFailed { .. } => {
            "the agent had too many faults, so there is no dataset; once the day is released, GET /api/v1/evaluations/ID \
             returns its faults and log"
        }
        EvaluationState::PlatformFailed { .. } => {
            "the evaluation failed by a platform fault and has no dataset; GET /api/v1/evaluations lists its rerun"
        }
        EvaluationState::DeadlineMissed { .. } => {
            "the evaluation did not finish before the deadline and has no dataset"
        }
        EvaluationState::Cancelled { .. } => "the evaluation was cancelled and has no dataset",
    };
    Err(Problem::new(ProblemKind::Conflict, no_dataset_reason))
}

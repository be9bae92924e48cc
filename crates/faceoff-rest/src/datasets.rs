//! Recorded datasets: the archive, and what of it is read without a download.

use super::{
    document::{Binary, FileHeaders, TagHeader},
    downloads::{Download, download, plain, stays_its_callers},
    proposals,
    recorded::Recorded,
};
use crate::links::{self, LinkOr, LinkQuery};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_api::{
    paths,
    requests::NewLink,
    views::{evaluation::EvaluationView, link::LinkView, violations::ViolationsView},
};
use faceoff_service::{
    app::App,
    archived,
    auth::{Caller, TeamCaller},
    conditions::{Conditions, ETag},
    extract::{OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    release::check_released,
    viewer::Viewer,
    views::{evaluation, sight::Sight, violations},
};
use faceoff_store::{EvaluationState, StoreError};
use faceoff_types::EvaluationId;

/// The recorded dataset, a zip archive; for its team and the organiser, and once it is public for everybody.
///
/// It carries the day's seed. So it comes out when the day is released, with all others of the day. What a proposal or
/// a trial has played is the organiser's alone, before the proposal is settled.
#[utoipa::path(
    get, path = "/evaluations/{id}/dataset", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 403, description = "the link is not good"),
        (status = 404),
        (status = 409, description = "not finished yet, or failed, its day is not released, or its stage is blind"),
        (status = 410, description = "it was removed, by a retention or with its proposal, and the detail says when and why; or the link has expired"),
    )
)]
pub(crate) async fn dataset(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let recorded = recorded(viewer, &app, id).await?;
    let team = app.store.team(recorded.team).await?;
    let file = Download {
        key: &recorded.dataset,
        blake3: recorded.blake3.as_deref(),
        media_type: "application/zip",
        name: &format!("faceoff-{}-{}.zip", plain(team.name.as_str()), recorded.day),
    };
    match download(&app, &conditions, file).await {
        Err(StoreError::NotFound(_)) => {
            // It may have gone meanwhile. A dataset that is promised must be there: without it, we lost it.
            if proposals::dataset(viewer, &app, id).await?.is_none() {
                released(viewer, &app, id).await?;
            }
            Err(Problem::internal(format_args!("{} is lost", file.key)))
        }
        answer => Ok(answer?),
    }
}

/// A link that downloads the dataset without a token, for a time; made by whoever may download it now.
///
/// What it opens is decided when it is followed, as if whoever made it asked then: it ends with the token that made it,
/// and shows nothing that was hidden or removed meanwhile.
#[utoipa::path(
    post, path = "/evaluations/{id}/dataset/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "there is no dataset to download, as for a download"),
        (status = 410, description = "it was removed"),
        (status = 422),
    )
)]
pub(crate) async fn link_dataset(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    OptionalJson(wanted): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    recorded(Viewer::of(&caller), &app, id).await?;
    let path = format!("{}/dataset", paths::evaluation(id));
    links::link(&app, &caller, &path, wanted).await
}

/// Where each constraint was broken and which answers were slow, by episode: `violations.json` of the dataset,
/// for those who get the dataset. A slow answer tells what it took, what of it the
/// host took, and the agent's CPU time meanwhile.
#[utoipa::path(
    get, path = "/evaluations/{id}/violations", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), TagHeader),
    responses(
        (status = 200, body = ViolationsView),
        (status = 404),
        (status = 409, description = "not finished yet, or failed, its day is not released, or its stage is blind"),
        (status = 410, description = "the dataset was removed; the detail says when and by which retention"),
    )
)]
pub(crate) async fn violations(
    viewer: Viewer,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let recorded = released(viewer, &app, id).await?;
    // They are read out of the dataset by this program.
    let made_of = recorded.blake3.as_deref().unwrap_or(&recorded.dataset);
    let tag = ETag::of("violations", &[made_of, env!("CARGO_PKG_VERSION")]);
    let mut answer = match conditions.not_modified(&tag) {
        Some(answer) => answer,
        None => {
            let view = violations::read(&app, &recorded.dataset).await?;
            ([(header::ETAG, tag.header())], Json(view)).into_response()
        }
    };
    stays_its_callers(answer.headers_mut());
    Ok(answer)
}

/// Makes a finished evaluation of the team's public, with its dataset, before its stage does: everybody sees it from
/// then on, without a token, and that stays so.
#[utoipa::path(
    post, path = "/evaluations/{id}/publish", tag = "team", security(("team" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "not finished, its day is not released, its stage is blind, or its boards are frozen and leave it out"),
    )
)]
pub(crate) async fn publish_evaluation(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Json<EvaluationView>, Problem> {
    let team = &caller.team;
    let sight = Sight::of(&app, Viewer::Team(team.id)).await?;
    let evaluation = sight.readable(app.store.evaluation(id).await)?;
    if evaluation.team != team.id {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "the evaluation is another team's, and public already",
        ));
    }
    sight.check_shown(evaluation.of.stage)?;
    if let EvaluationState::Finished { .. } = &evaluation.state {
        check_released(&app, &evaluation).await?;
        sight.check_not_frozen(&evaluation, "published")?;
    }
    let now = app.config.clock.now();
    let published = app
        .store
        .publish_evaluation(caller.actor(), id, now)
        .await?;
    tracing::info!(evaluation = %id, team = %team.name, "evaluation published by its team");
    evaluation::of(&app, &sight, published).await.map(Json)
}

/// The dataset of an evaluation, for whoever may have it now.
async fn recorded(viewer: Viewer, app: &App, id: EvaluationId) -> Result<Recorded, Problem> {
    match proposals::dataset(viewer, app, id).await? {
        Some(proposed) => {
            archived::check_kept(app, &proposed.dataset, "dataset").await?;
            Ok(proposed)
        }
        None => released(viewer, app, id).await,
    }
}

/// The dataset of a finished evaluation whose day is released.
async fn released(viewer: Viewer, app: &App, id: EvaluationId) -> Result<Recorded, Problem> {
    let sight = Sight::of(app, viewer).await?;
    let evaluation = sight.readable(app.store.evaluation(id).await)?;
    sight.check_shown(evaluation.of.stage)?;
    let why_not = match &evaluation.state {
        EvaluationState::Finished {
            dataset,
            dataset_blake3,
            ..
        } => {
            check_released(app, &evaluation).await?;
            let is_there = app.store.artifacts().bytes_of(dataset).await?.is_some();
            // An organiser gets at evidence as long as the file is there.
            if let Some(removed) = &evaluation.dataset_removed
                && !(viewer == Viewer::Organiser && is_there)
            {
                let what = "the dataset, with all that is read out of it,";
                return Err(Problem::removed(what, removed));
            }
            archived::check_kept(app, dataset, "dataset").await?;
            return Ok(Recorded {
                team: evaluation.team,
                day: evaluation.of.date,
                dataset: dataset.clone(),
                blake3: dataset_blake3.clone(),
            });
        }
        EvaluationState::Queued | EvaluationState::Running { .. } | EvaluationState::Finalising => {
            "the evaluation is not finished; follow it until its state is “finished”"
        }
        EvaluationState::AgentFailed { .. } => {
            "the agent failed too often, so there is no dataset; once the day is released its faults and \
             log are in GET /api/v1/evaluations/ID"
        }
        EvaluationState::PlatformFailed { .. } => {
            "the evaluation failed by our fault and has no dataset; GET /api/v1/evaluations lists the one \
             that plays it again"
        }
        EvaluationState::NotPlayed { .. } => {
            "the evaluation was not played in time and has no dataset"
        }
        EvaluationState::Cancelled { .. } => "the evaluation was cancelled and has no dataset",
    };
    Err(Problem::new(ProblemKind::Conflict, why_not))
}

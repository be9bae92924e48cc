//! Recorded datasets: the archive, and what of it is read without a download.

use super::{downloads::download, proposals};
use crate::{
    app::App,
    archived,
    auth::TeamCaller,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    release::check_released,
    viewer::Viewer,
    views::{evaluation::EvaluationView, sight::Sight, violations::ViolationsView},
};
use axum::{Json, extract::State, response::Response};
use faceoff_store::{Evaluation, EvaluationState, StoreError};
use faceoff_types::EvaluationId;
use jiff::civil::Date;

/// The recorded dataset, a zip archive; for its team and the organiser, and once it is public for everybody.
///
/// It carries the day's seed. So it comes out when the day is released, with all others of the day. What a proposal or
/// a trial has played is the organiser's alone, before the proposal is settled.
#[utoipa::path(
    get, path = "/evaluations/{id}/dataset", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 200, body = Vec<u8>, content_type = "application/zip"),
        (status = 404),
        (status = 409, description = "not finished yet, or failed, its day is not released, or its stage is blind"),
        (status = 410, description = "it was removed, by a retention or with its proposal; the detail says when and why"),
    )
)]
pub(crate) async fn dataset(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let (team, date, dataset) = match proposals::dataset(viewer, &app, id).await? {
        Some(proposed) => {
            archived::check_kept(&app, &proposed.2, "dataset").await?;
            proposed
        }
        None => {
            let (evaluation, dataset) = released(viewer, &app, id).await?;
            (evaluation.team, evaluation.of.date, dataset)
        }
    };
    let team = app.store.team(team).await?;
    let name = download_name(team.name.as_str(), date);
    match download(&app, &dataset, "application/zip", &name).await {
        Err(StoreError::NotFound(_)) => {
            // It may have gone meanwhile. A dataset that is promised must be there: without it, we lost it.
            if proposals::dataset(viewer, &app, id).await?.is_none() {
                released(viewer, &app, id).await?;
            }
            Err(Problem::internal(format_args!("{dataset} is lost")))
        }
        answer => Ok(answer?),
    }
}

/// Where each constraint was broken and which answers were slow, by episode: `violations.json` of the dataset,
/// for those who get the dataset. A slow answer tells what it took, what of it the
/// host took, and the agent's CPU time meanwhile.
#[utoipa::path(
    get, path = "/evaluations/{id}/violations", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 200, body = ViolationsView),
        (status = 404),
        (status = 409, description = "not finished yet, or failed, its day is not released, or its stage is blind"),
        (status = 410, description = "the dataset was removed; the detail says when and by which retention"),
    )
)]
pub(crate) async fn violations(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Json<ViolationsView>, Problem> {
    let (_, dataset) = released(viewer, &app, id).await?;
    ViolationsView::read(&app, &dataset).await.map(Json)
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
    EvaluationView::of(&app, &sight, published).await.map(Json)
}

/// A finished evaluation whose day is released, and its dataset's name among the artifacts.
async fn released(
    viewer: Viewer,
    app: &App,
    id: EvaluationId,
) -> Result<(Evaluation, String), Problem> {
    let sight = Sight::of(app, viewer).await?;
    let evaluation = sight.readable(app.store.evaluation(id).await)?;
    sight.check_shown(evaluation.of.stage)?;
    let why_not = match &evaluation.state {
        EvaluationState::Finished { dataset, .. } => {
            check_released(app, &evaluation).await?;
            let is_there = app.store.artifacts().bytes_of(dataset).await?.is_some();
            // An organiser gets at evidence as long as the file is there.
            if let Some(removed) = &evaluation.dataset_removed
                && !(viewer == Viewer::Organiser && is_there)
            {
                let what = "the dataset, with all that is read out of it,";
                return Err(Problem::removed(what, removed));
            }
            let dataset = dataset.clone();
            archived::check_kept(app, &dataset, "dataset").await?;
            return Ok((evaluation, dataset));
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

/// A file name without anything that a header or a file system could trip over.
fn download_name(team: &str, day: Date) -> String {
    let team: String = team
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    format!("faceoff-{team}-{day}.zip")
}

//! The card of an evaluation: its score.

use super::{
    layout::{Card, PercentWithInterval},
    response::respond,
};
use crate::frame::PageProblem;
use axum::{extract::State, response::Response};
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView, ResultView};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::Problem,
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{evaluation, visibility::Visibility},
};
use faceoff_types::EvaluationId;

pub(super) async fn picture(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    id: Result<PathParam<EvaluationId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    respond(&app, &preconditions, load(&app, id)).await
}

async fn load(app: &App, id: EvaluationId) -> Result<Card, PageProblem> {
    let visibility = Visibility::load(app, Viewer::Visitor).await?;
    let view = evaluation::find(app, &visibility, id).await?;
    let competition = app.config.competition();
    let mut card = Card::new(&competition.short_title);
    let voided = view.voided.as_ref().map_or("", |_| ", voided");
    let subtitle = format!("evaluation of {}{voided}", view.day);
    card.title(view.team_name.as_str(), &subtitle);
    let Some(result) = visible_result(&view, &visibility) else {
        // The same words in all states: the picture does not reveal that a hidden result has arrived.
        card.note("There is no public result.", 350.0);
        return Ok(card);
    };
    let weights = competition.weights(&result.variation);
    let score = PercentWithInterval::of_score(result.score, &result.tasks, &weights);
    card.score(&score, result.tier);
    card.tasks(competition, &result.tasks);
    Ok(card)
}

/// The result, if there is one that the viewer may see.
fn visible_result<'a>(view: &'a EvaluationView, visibility: &Visibility) -> Option<&'a ResultView> {
    match &view.status {
        EvaluationStatus::Finished {
            finished_at,
            result: Some(result),
            ..
        } => visibility
            .hiding_freeze(view.stage, *finished_at)
            .is_none()
            .then_some(result),
        _ => None,
    }
}

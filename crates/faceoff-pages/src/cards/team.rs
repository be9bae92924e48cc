//! The card of a team: its latest result.

use super::{
    layout::{Card, PercentWithInterval},
    response::respond,
};
use crate::frame::PageProblem;
use axum::{extract::State, response::Response};
use faceoff_api::{
    requests::{HistoryQuery, TeamPageQuery},
    views::history::HistoryRow,
};
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{history, team, visibility::Visibility},
};
use faceoff_types::TeamId;

pub(super) async fn picture(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    id: Result<PathParam<TeamId>, Problem>,
    query: Result<QueryParams<TeamPageQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), QueryParams(query)) = (id?, query?);
    respond(&app, &preconditions, load(&app, id, query)).await
}

async fn load(app: &App, id: TeamId, query: TeamPageQuery) -> Result<Card, PageProblem> {
    let visibility = Visibility::load(app, Viewer::Visitor).await?;
    let team = team::find(app, id).await?;
    let query = HistoryQuery {
        stage: query.stage,
        ..HistoryQuery::default()
    };
    let history = history::query(app, &visibility, query).await?;
    let competition = app.config.competition();
    let mut card = Card::new(&competition.short_title);
    let mut rows = history.rows.iter();
    let Some(latest) = rows.rfind(|row| row.team_id == id) else {
        card.title(team.name.as_str(), history.stage_name.as_str());
        let note = match visibility.hides_scores(history.stage) {
            true => "The results are hidden until the organisers reveal them.",
            false => "No result yet.",
        };
        card.note(note, 350.0);
        return Ok(card);
    };
    let subtitle = format!("{}, {}", history.stage_name, rank_text(latest));
    card.title(team.name.as_str(), &subtitle);
    let revisions = app.store.stage_revisions(history.stage).await?;
    let revision = revisions
        .into_iter()
        .find(|revision| revision.number == history.revision)
        .ok_or_else(|| Problem::internal("history without its revision"))?;
    let weights = competition.weights(&revision.rules.variation);
    card.score(
        &PercentWithInterval::of_score(latest.score, &latest.tasks, &weights),
        latest.tier,
    );
    card.tasks(competition, &latest.tasks);
    Ok(card)
}

fn rank_text(row: &HistoryRow) -> String {
    match row.rank {
        Some(rank) => format!("rank {rank} on {}", row.day),
        None if row.baseline => format!("reference agent, {}", row.day),
        None => row.day.to_string(),
    }
}

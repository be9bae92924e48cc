//! `/teams/{id}`: what a team came to, day by day, and what it has entered.

mod days;

use super::{
    chart::Panel,
    entry::Entry,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use days::{Broken, Day, Now};
use faceoff_api::{
    requests::{HistoryQuery, TeamPageQuery},
    views::{evaluation::EvaluationView, ruling::RulingView, team::TeamView},
};
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{
        evaluation, history, season::SeasonHead, sight::Sight, stage, submission, team,
        tournament::entered_by,
    },
};
use faceoff_types::{StageDay, StageName, TeamId, TournamentId};

#[derive(Template)]
#[template(path = "team.html")]
struct Page {
    frame: Frame,
    team: TeamView,
    stage: String,
    /// The other stages: name and query.
    others: Vec<(String, String)>,
    /// Its scores are not for the viewer.
    is_hidden: bool,
    frozen: Option<RulingView>,
    /// Those that it has entered: ids and names.
    tournaments: Vec<(TournamentId, StageName)>,
    now: Option<Now>,
    panels: Vec<Panel>,
    /// The newest first.
    days: Vec<Day>,
    broken: Vec<Broken>,
    /// Of today, without a result.
    under_way: Vec<EvaluationView>,
    /// For the team itself and for organisers; nobody else sees what was not played.
    entered: Option<Vec<Entry>>,
    /// The query that asks the API for the same days.
    of_days: String,
}

/// A team, in a stage.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<TeamId>, Problem>,
    query: Result<QueryParams<TeamPageQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), QueryParams(query)) = (id?, query?);
    let viewer = viewer?;
    let sight = Sight::of(&app, viewer).await?;
    let season = SeasonHead::now(&app).await?;
    let team = team::find(&app, id).await?;
    let history = HistoryQuery {
        stage: query.stage,
        ..HistoryQuery::default()
    };
    let mut history = history::asked(&app, &sight, history).await?;
    history.rows.retain(|row| row.team_id == id);
    let stage = app
        .store
        .stage(history.stage)
        .await
        .map_err(Problem::from)?;
    let revisions = app
        .store
        .stage_revisions(stage.id)
        .await
        .map_err(Problem::from)?;
    let rules = revisions
        .into_iter()
        .find(|one| one.number == history.revision)
        .ok_or_else(|| Problem::internal("days without their rules"))?;
    let variation = rules.rules.variation;
    let today: StageDay = stage.day(app.config.clock.now());
    let mut under_way = evaluation::current(&app, &sight, today).await?;
    under_way.retain(|of| of.team == id && !of.status.is_final());
    let entered = match viewer {
        Viewer::Organiser => true,
        Viewer::Team(own) => own == id,
        Viewer::Anybody => false,
    };
    let entered = match entered {
        true => Some(submission::of_team(&app, id).await?),
        false => None,
    };
    let others = stage::all(&app).await?;
    let others = others.into_iter().filter(|of| of.id != stage.id);
    render(&Page {
        tournaments: entered_by(&app, id).await?,
        frame: Frame::of(&app, season.name, ""),
        stage: stage.name.to_string(),
        others: others
            .map(|of| (of.name.to_string(), format!("?stage={}", of.id)))
            .collect(),
        is_hidden: sight.is_hidden(stage.id),
        now: history
            .rows
            .last()
            .map(|row| Now::of(row, &variation.tier_bounds)),
        panels: days::panels(&history.rows, &variation),
        broken: days::broken(&history.rows),
        days: history
            .rows
            .iter()
            .rev()
            .map(|row| Day::of(row, &variation))
            .collect(),
        of_days: format!("?stage={}&revision={}", stage.id, history.revision),
        frozen: history.frozen,
        under_way,
        entered: entered.map(|all| all.iter().map(Entry::from).collect()),
        team,
    })
}

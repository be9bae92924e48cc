//! `/teams/{id}`: results of a team by day, and its submissions.

mod days;

use super::{
    chart::DayChart,
    frame::{Frame, NO_ENTRY, PageProblem, render},
    query::with_query,
    submission_row::SubmissionRow,
};
use askama::Template;
use axum::{extract::State, response::Response};
use days::{DayResult, LatestResult, TaskViolations};
use faceoff_api::{
    requests::{HistoryQuery, TeamPageQuery},
    views::{decision::DecisionView, evaluation::EvaluationView, team::TeamView},
};
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{
        evaluation, history, stage, submission, team, tournament::entered_tournaments,
        visibility::Visibility,
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
    other_stages: Vec<(String, String)>,
    /// Are the scores hidden from the viewer?
    is_hidden: bool,
    frozen: Option<DecisionView>,
    /// Tournaments of the team.
    tournaments: Vec<(TournamentId, StageName)>,
    /// Does the competition have tiers?
    has_tiers: bool,
    latest: Option<LatestResult>,
    day_charts: Vec<DayChart>,
    task_titles: Vec<String>,
    /// The newest first.
    days: Vec<DayResult>,
    violations: Vec<TaskViolations>,
    violation_headers: Vec<crate::format::ViolationHeader>,
    /// Running and queued evaluations of today.
    open_evaluations: Vec<EvaluationView>,
    /// Visible to the team and organisers only.
    submissions: Option<Vec<SubmissionRow>>,
    /// Query with which the API returns the same days.
    history_query: String,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<TeamId>, Problem>,
    query: Result<QueryParams<TeamPageQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), QueryParams(query)) = (id?, query?);
    let viewer = viewer?;
    let visibility = Visibility::load(&app, viewer).await?;
    let team = team::find(&app, id).await?;
    let history = HistoryQuery {
        stage: query.stage,
        ..HistoryQuery::default()
    };
    let mut history = history::query(&app, &visibility, history).await?;
    history.rows.retain(|row| row.team_id == id);
    let stage = app.store.stage(history.stage).await?;
    let revisions = app.store.stage_revisions(stage.id).await?;
    let revision = revisions
        .into_iter()
        .find(|revision| revision.number == history.revision)
        .ok_or_else(|| Problem::internal("history without its revision"))?;
    let variation = revision.rules.variation;
    let bounds = app.config.competition().tier_bounds(&variation);
    let today: StageDay = stage.day(app.config.clock.now());
    let mut open_evaluations = evaluation::current(&app, &visibility, today).await?;
    open_evaluations.retain(|evaluation| evaluation.team == id && !evaluation.status.is_final());
    let sees_submissions = match viewer {
        Viewer::Organiser => true,
        Viewer::Team(viewing_team) => viewing_team == id,
        Viewer::Visitor => false,
    };
    let submissions = match sees_submissions {
        true => Some(submission::team_submissions(&app, id).await?),
        false => None,
    };
    let other_stages = stage::all(&app).await?;
    let other_stages = other_stages
        .into_iter()
        .filter(|other| other.id != stage.id);
    render(&Page {
        tournaments: entered_tournaments(&app, id).await?,
        frame: Frame::load(&app, NO_ENTRY)
            .await?
            .with_address(&app, &format!("/teams/{id}"))
            .with_card(
                &app,
                &with_query(&format!("/teams/{id}/card.png"), &query),
                format!("{}: rank, score and success by task", team.name),
            ),
        stage: stage.name.to_string(),
        other_stages: other_stages
            .map(|other| (other.name.to_string(), format!("?stage={}", other.id)))
            .collect(),
        is_hidden: visibility.hides_scores(stage.id),
        has_tiers: bounds.is_some(),
        latest: history
            .rows
            .last()
            .map(|row| LatestResult::new(row, bounds)),
        task_titles: app
            .config
            .competition()
            .tasks
            .iter()
            .map(|info| info.title.clone())
            .collect(),
        day_charts: days::charts(&history.rows, &variation, app.config.competition()),
        violation_headers: crate::format::violation_headers(app.config.competition()),
        violations: days::violations(&history.rows, app.config.competition()),
        days: history
            .rows
            .iter()
            .rev()
            .map(|row| DayResult::new(row, &variation, app.config.competition()))
            .collect(),
        history_query: format!("?stage={}&revision={}", stage.id, history.revision),
        frozen: history.frozen,
        open_evaluations,
        submissions: submissions.map(|all| all.iter().map(SubmissionRow::from).collect()),
        team,
    })
}

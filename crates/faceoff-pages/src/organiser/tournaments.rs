//! `/organiser/tournaments`: the tournaments of the season with their pending decisions, and a form for a new one.

use super::tournament_form::TournamentForm;
use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageOrganiser,
    tournament_text,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::tournament::TournamentSummary;
use faceoff_service::{
    app::App,
    extract::PageForm,
    problem::Problem,
    services::tournaments,
    views::{
        pending_decisions::{self, TournamentDecisionKind},
        tournament,
    },
};
use faceoff_types::StageName;

pub(super) const PATH: &str = "/organiser/tournaments";

/// A tournament in the table.
struct Row {
    summary: TournamentSummary,
    phase: String,
    teams: usize,
    /// Number of games of the started rounds: those with a result, and all that are not cancelled.
    played: u32,
    games: u32,
    /// The decision that the organisers have to take next, as a sentence.
    decision: Option<String>,
}

#[derive(Template)]
#[template(path = "organiser_tournaments.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    /// Does the competition have games of two agents?
    has_games: bool,
    /// Does the competition have tiers, which qualify teams?
    has_tiers: bool,
    /// The newest first.
    rows: Vec<Row>,
    stages: Vec<StageName>,
    form: TournamentForm,
    is_refused: bool,
}

/// The pending decision as a sentence.
pub(super) fn decision_text(kind: TournamentDecisionKind) -> String {
    match kind {
        TournamentDecisionKind::Rerun { games: 1 } => {
            "1 game has no result and has to be rerun.".to_owned()
        }
        TournamentDecisionKind::Rerun { games } => {
            format!("{games} games have no result and have to be rerun.")
        }
        TournamentDecisionKind::StartRound => "The next round can start.".to_owned(),
        TournamentDecisionKind::Close => {
            "All rounds have been played: the tournament can be closed.".to_owned()
        }
    }
}

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    notice: Notice<'_>,
    form: TournamentForm,
) -> Result<Response, PageProblem> {
    let mut rows = Vec::new();
    for tournament in app.store.tournaments().await?.into_iter().rev() {
        let state = tournament::state_for_list(app, tournament.id).await?;
        let summary = tournament::summary(&state);
        let progress = tournament::progress(&state);
        let teams = state.entrants.iter();
        rows.push(Row {
            phase: tournament_text::phase_label(&summary),
            teams: teams.filter(|team| team.departure.is_none()).count(),
            played: progress.played,
            games: progress.games - progress.cancelled,
            decision: pending_decisions::of_tournament(&state).map(decision_text),
            summary,
        });
    }
    let stages = app.store.stages().await?.into_iter();
    let page = Page {
        frame: Frame::load(app, PATH).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        has_games: app.config.competition().has_games,
        has_tiers: app.config.competition().tiers.is_some(),
        rows,
        stages: stages.map(|stage| stage.name).collect(),
        form,
        is_refused: matches!(notice, Notice::Refused(_)),
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    let form = TournamentForm::defaults(&app).await?;
    page_with(&app, &user, Notice::Done(&notice), form).await
}

pub(super) async fn open(
    user: PageOrganiser,
    State(app): State<App>,
    form: Result<PageForm<TournamentForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let actor = user.organiser.actor();
    let opened = match form.request() {
        Ok(request) => tournaments::open_tournament(&app, actor, request).await,
        Err(problem) => Err(problem),
    };
    match opened {
        Ok(tournament) => Ok(redirect_done(
            &format!("{PATH}/{}", tournament.id),
            "tournament-opened",
        )),
        Err(problem) => page_with(&app, &user, Notice::Refused(&problem), form).await,
    }
}

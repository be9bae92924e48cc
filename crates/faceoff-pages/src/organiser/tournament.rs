//! `/organiser/tournaments/{id}`: status, games, teams and decisions of a tournament.

use super::{form_lines, tournaments::PATH};
use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, NO_ENTRY, PageProblem},
    game_row::{GameRow, GameState, ResultDisplay},
    page_auth::PageOrganiser,
    tournament_text,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::tournament::{EntrantView, TournamentPhase, TournamentView};
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    services::entrants,
    viewer::Viewer,
    views::{game, tournament, tournament_state::TournamentState},
};
use faceoff_types::{DepartureKind, TeamName, TournamentFormat, TournamentId};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "organiser_tournament.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    view: TournamentView,
    phase: String,
    format: String,
    last_round: String,
    /// Number of teams that have not left.
    teams: usize,
    /// Number of games of the started rounds: those with a result, and all that are not cancelled.
    played: u32,
    games: u32,
    /// Games without a result that have to be rerun.
    to_rerun: Vec<GameRow>,
    /// Games with a result, which can be voided. The last round first.
    with_result: Vec<GameRow>,
    is_closed: bool,
    is_round_running: bool,
    can_start_round: bool,
    can_close: bool,
    can_enter: bool,
    form: EntrantsForm,
}

impl Page {
    /// Can the organisers disqualify the team? Also after it has withdrawn: a team must not avoid disqualification by that.
    fn can_disqualify(&self, entrant: &EntrantView) -> bool {
        let has_started = !self.view.rounds.is_empty();
        let departure = entrant.departure.as_ref();
        departure.is_none_or(|departure| has_started && departure.kind == DepartureKind::Withdrawn)
    }
}

/// Teams to enter.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct EntrantsForm {
    /// One name per line.
    teams: String,
}

/// Path of a tournament's page.
pub(super) fn page_path(id: TournamentId) -> String {
    format!("{PATH}/{id}")
}

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    id: TournamentId,
    notice: Notice<'_>,
    form: EntrantsForm,
) -> Result<Response, PageProblem> {
    let state = TournamentState::find(app, id).await?;
    let view = tournament::view(&state)?;
    let round_games = game::round_games(&state, Viewer::Organiser, None)?;
    // The last round first, without games that the departure of a team excluded.
    let counting_games = round_games.iter().rev();
    let counting_games: Vec<GameRow> = counting_games
        .filter_map(|game| GameRow::new(game, ResultDisplay::Shown))
        .filter(|game| game.departed_team.is_none())
        .collect();
    let rows_in = |is_selected: fn(&GameState) -> bool| {
        let selected = counting_games
            .iter()
            .filter(|game| is_selected(&game.state));
        selected.cloned().collect::<Vec<_>>()
    };
    let phase = view.summary.phase;
    let can_start_round = matches!(
        phase,
        TournamentPhase::Open | TournamentPhase::BetweenRounds
    );
    let has_groups = matches!(view.rules.format, TournamentFormat::Groups { .. });
    let progress = tournament::progress(&state);
    let teams = view.entrants.iter();
    let page = Page {
        frame: Frame::load(app, NO_ENTRY).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        phase: tournament_text::phase_label(&view.summary),
        format: tournament_text::describe_format(&view.rules),
        last_round: view.rules.format.last_round().to_string(),
        teams: teams.filter(|team| team.departure.is_none()).count(),
        played: progress.played,
        games: progress.games - progress.cancelled,
        to_rerun: rows_in(|state| matches!(state, GameState::Void | GameState::Failed)),
        with_result: rows_in(|state| matches!(state, GameState::Played { .. })),
        is_closed: phase == TournamentPhase::Closed,
        is_round_running: phase == TournamentPhase::RoundRunning,
        can_start_round,
        can_close: can_start_round || phase == TournamentPhase::AllRoundsPlayed,
        can_enter: phase == TournamentPhase::Open
            || phase == TournamentPhase::BetweenRounds && !has_groups,
        form,
        view,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<TournamentId>, Problem>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    let form = EntrantsForm::default();
    page_with(&app, &user, id?.0, Notice::Done(&notice), form).await
}

/// Enters teams into the tournament.
pub(super) async fn enter(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<TournamentId>, Problem>,
    form: Result<PageForm<EntrantsForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let entered = match form_lines::parse::<TeamName>("teams", &form.teams) {
        Ok(names) => entrants::enter_teams(&app, user.organiser.actor(), id, &names).await,
        Err(problem) => Err(problem),
    };
    match entered {
        Ok(()) => Ok(redirect_done(&page_path(id), "teams-entered")),
        Err(problem) => page_with(&app, &user, id, Notice::Refused(&problem), form).await,
    }
}

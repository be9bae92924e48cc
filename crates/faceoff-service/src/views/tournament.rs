//! Tournaments: rules, entrants (teams), rounds of games, and tables with the standings. A round has *matchdays*, in each of which a
//! team plays one game or has a *bye* (no game).

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{decision, tournament_state::TournamentState},
};
use faceoff_api::views::{
    printable,
    tournament::{
        ByeView, DepartureView, EntrantView, RoundProgress, RoundSubmission, RoundView,
        TournamentPhase, TournamentSummary, TournamentView,
    },
};
use faceoff_scoring::tournament::schedule::Table;
use faceoff_store::{Departure, Entrant, Game, GamePurpose, GameState, TournamentRound};
use faceoff_types::{RoundNumber, StageName, TeamId, TeamName, TournamentId};

/// Summaries of all tournaments, without rounds and tables, in order of creation.
#[boxed_future]
pub async fn summaries(app: &AppState) -> Result<Vec<TournamentSummary>, Problem> {
    let mut summaries = Vec::new();
    for tournament in app.store.tournaments().await? {
        summaries.push(summary(&state_for_list(app, tournament.id).await?));
    }
    Ok(summaries)
}

/// The state of a tournament for lists: standings are built only once they decide the champion.
#[boxed_future]
pub async fn state_for_list(app: &AppState, id: TournamentId) -> Result<TournamentState, Problem> {
    let state = TournamentState::without_standings(app, id).await?;
    match is_decided(&state) {
        true => state.with_standings(),
        false => Ok(state),
    }
}

/// The summary of a tournament, whose state has standings if they decide the champion.
pub fn summary(state: &TournamentState) -> TournamentSummary {
    let tables = match is_decided(state) {
        true => state.tables(state.played()),
        false => Vec::new(),
    };
    build_summary(state, &tables)
}

/// The numbers of games of all started rounds.
pub fn progress(state: &TournamentState) -> RoundProgress {
    let mut progress = RoundProgress::default();
    for game in &state.games {
        if matches!(game.purpose, GamePurpose::Round(_)) {
            count_game(&mut progress, &game.state);
        }
    }
    progress
}

fn build_summary(state: &TournamentState, tables: &[Table]) -> TournamentSummary {
    let tournament = &state.tournament;
    let phase = phase(state);
    TournamentSummary {
        id: tournament.id,
        number: tournament.number,
        name: tournament.name.clone(),
        phase,
        created_at: tournament.created_at,
        stage: tournament.stage,
        paused: tournament.paused.clone().map(decision::view),
        closed_at: tournament.closed_at,
        champion: champion(state, tables),
        next: next_text(state, phase),
    }
}

/// A tournament with its rounds and tables.
#[boxed_future]
pub async fn find(app: &AppState, id: TournamentId) -> Result<TournamentView, Problem> {
    view(&TournamentState::find(app, id).await?)
}

/// A tournament with its rounds and tables.
pub fn view(state: &TournamentState) -> Result<TournamentView, Problem> {
    let tables = state.tables(state.played());
    let tournament = &state.tournament;
    let rounds = state.rounds.iter();
    Ok(TournamentView {
        summary: build_summary(state, &tables),
        rules: tournament.rules.clone(),
        settings: tournament.settings.clone(),
        baseline: tournament.baseline,
        entrants: state.entrants.iter().cloned().map(entrant).collect(),
        rounds: rounds
            .map(|round| round_view(state, round))
            .collect::<Result<_, _>>()?,
        tables,
    })
}

/// Ids and names of the tournaments that a team has entered, in order of creation.
#[boxed_future]
pub async fn entered_tournaments(
    app: &AppState,
    team: TeamId,
) -> Result<Vec<(TournamentId, StageName)>, Problem> {
    let mut entered = Vec::new();
    for tournament in app.store.tournaments().await? {
        let state = TournamentState::without_standings(app, tournament.id).await?;
        if state.entrants.iter().any(|entrant| entrant.team == team) {
            entered.push((tournament.id, tournament.name));
        }
    }
    Ok(entered)
}

pub fn entrant(entrant: Entrant) -> EntrantView {
    EntrantView {
        team: entrant.team,
        team_name: entrant.name,
        entered_at: entrant.entered_at,
        departure: entrant.departure.map(departure),
    }
}

pub fn departure(departure: Departure) -> DepartureView {
    DepartureView {
        kind: departure.kind,
        from_round: departure.from_round,
        at: departure.at,
        reason: printable(departure.reason),
    }
}

/// A round with its draw and progress.
pub fn round_view(state: &TournamentState, round: &TournamentRound) -> Result<RoundView, Problem> {
    let games = games_in_round(state, round.number);
    let names = |group: &Vec<TeamId>| -> Result<Vec<TeamName>, Problem> {
        group.iter().map(|team| state.name(*team)).collect()
    };
    let byes = round.byes.iter().map(|bye| {
        Ok(ByeView {
            matchday: bye.matchday,
            team: bye.team,
            team_name: state.name(bye.team)?,
        })
    });
    let submissions = round.submissions.iter().map(|(team, submission)| {
        Ok(RoundSubmission {
            team: *team,
            team_name: state.name(*team)?,
            submission: *submission,
        })
    });
    let mut progress = RoundProgress::default();
    let mut matchdays = 0;
    for (game, matchday) in games {
        matchdays = matchday.max(matchdays);
        count_game(&mut progress, &game.state);
    }
    Ok(RoundView {
        number: round.number,
        started_at: round.started_at,
        ended_at: round.over_at,
        matchdays,
        progress,
        groups: round.groups.iter().map(names).collect::<Result<_, _>>()?,
        byes: byes.collect::<Result<_, Problem>>()?,
        submissions: submissions.collect::<Result<_, Problem>>()?,
    })
}

/// Counts a game in the field of its state.
const fn count_game(progress: &mut RoundProgress, state: &GameState) {
    progress.games += 1;
    *match state {
        GameState::Queued => &mut progress.queued,
        GameState::Running { .. } => &mut progress.running,
        GameState::Played(_) => &mut progress.played,
        GameState::PlatformFailed { .. } | GameState::Void { .. } => &mut progress.to_be_rerun,
        GameState::Cancelled { .. } => &mut progress.cancelled,
    } += 1;
}

/// The games of a round, with their matchdays.
fn games_in_round(
    state: &TournamentState,
    number: RoundNumber,
) -> impl Iterator<Item = (&Game, u32)> {
    state
        .games
        .iter()
        .filter_map(move |game| match game.purpose {
            GamePurpose::Round(schedule_entry) if schedule_entry.round == number => {
                Some((game, schedule_entry.matchday))
            }
            _ => None,
        })
}

/// The phase: open for entrants, in a round, between two rounds, all rounds played, or closed by the organisers.
pub(super) fn phase(state: &TournamentState) -> TournamentPhase {
    let last_round = state.tournament.rules.format.last_round();
    if state.tournament.closed_at.is_some() {
        TournamentPhase::Closed
    } else if state.rounds.is_empty() {
        TournamentPhase::Open
    } else if state.games.iter().any(|game| state.needs_result(game))
        || state.rounds.iter().any(|round| round.over_at.is_none())
    {
        TournamentPhase::RoundRunning
    } else if state.rounds.len() < last_round.get() as usize {
        TournamentPhase::BetweenRounds
    } else {
        TournamentPhase::AllRoundsPlayed
    }
}

/// The first team of a table that has not left.
pub(super) fn first_place(table: &Table) -> Option<TeamName> {
    let mut standings = table.standings.iter();
    let first = standings.find(|standing| standing.departure.is_none())?;
    Some(first.team.clone())
}

/// Whether all rounds are over, so that there is a champion.
fn is_decided(state: &TournamentState) -> bool {
    let last_round = state.tournament.rules.format.last_round();
    // An archive may contain only a part of a round that was running.
    let all_rounds_over = state.rounds.iter().all(|round| round.over_at.is_some());
    state.rounds.len() >= last_round.get() as usize
        && all_rounds_over
        && !state.games.iter().any(|game| state.needs_result(game))
}

/// The champion, once all rounds are over.
fn champion(state: &TournamentState, tables: &[Table]) -> Option<TeamName> {
    first_place(tables.first().filter(|_| is_decided(state))?)
}

/// What happens next, in words.
fn next_text(state: &TournamentState, phase: TournamentPhase) -> String {
    let last_round = state.tournament.rules.format.last_round();
    let next_number = state.rounds.len() + 1;
    match phase {
        TournamentPhase::Closed => "The tournament is closed.".to_owned(),
        TournamentPhase::AllRoundsPlayed => {
            "All rounds have been played; the organisers still have to close the tournament."
                .to_owned()
        }
        TournamentPhase::Open | TournamentPhase::BetweenRounds => format!(
            "An organiser starts round {next_number} of {last_round}; the active submissions of that moment play the whole round."
        ),
        TournamentPhase::RoundRunning => running_round_text(state),
    }
}

fn running_round_text(state: &TournamentState) -> String {
    let mut progress = RoundProgress::default();
    let unfinished = state.games.iter().filter(|game| state.needs_result(game));
    unfinished.for_each(|game| count_game(&mut progress, &game.state));
    let unfinished_count = progress.games;
    let mut text = match &state.tournament.paused {
        Some(paused) => format!(
            "Paused ({}): no game starts. ",
            printable(paused.reason.clone())
        ),
        None => String::new(),
    };
    text += &format!(
        "Games without a result: {unfinished_count}; running: {}, waiting for a slot: {}",
        progress.running, progress.queued
    );
    if progress.to_be_rerun > 0 {
        text += &format!(
            ", void or failed, to be rerun by an organiser: {}",
            progress.to_be_rerun
        );
    }
    let last_round = state.tournament.rules.format.last_round();
    if state.rounds.len() < last_round.get() as usize {
        text + ". Then the next round can start."
    } else {
        text + ". Then the tournament can be closed."
    }
}

//! Pending decisions of the organisers: registrations, questions, results of closed stages, evaluations without a result through no fault
//! of the agent, and tournaments that do not go on without an organiser.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{tournament, tournament_state::TournamentState},
};
use faceoff_api::views::tournament::TournamentPhase;
use faceoff_store::{Evaluation, EvaluationState, GameState, RegistrationState, StagePhase};
use faceoff_types::{EvaluationId, StageName, TournamentId};
use std::{collections::BTreeSet, sync::Arc};

/// The number of pending decisions; `None` if the database cannot be read, which the page itself says.
#[boxed_future]
pub async fn count(app: &AppState) -> Option<usize> {
    let minute = app.config.clock.now().as_second() / 60;
    let key = (app.store.change_count(), minute);
    let counted = async { count_now(app).await.map(Arc::new).map_err(|_| ()) };
    let count = app.pending_decisions.get(key, counted).await;
    count.ok().map(|count| *count)
}

async fn count_now(app: &AppState) -> Result<usize, Problem> {
    let now = app.config.clock.now();
    let registrations = app.store.registrations().await?.into_iter();
    let registrations = registrations
        .filter(|registration| registration.state == RegistrationState::Pending)
        .count();
    let questions = app.store.questions().await?.into_iter();
    let questions = questions
        .filter(|question| question.answer.is_none())
        .count();
    let mut in_stages = 0;
    for stage in app.store.stages().await? {
        if stage.sign_off.is_some() {
            continue;
        }
        if stage.phase(now) == StagePhase::Closed {
            in_stages += 1;
        }
        if let Some(day) = app.store.newest_day(stage.id).await? {
            let evaluations = app.store.evaluations_of_day(day.stage_day).await?;
            in_stages += evaluations_to_rerun(&evaluations).count();
        }
    }
    let in_tournaments = of_tournaments(app).await?.len();
    Ok(registrations + questions + in_stages + in_tournaments)
}

/// A pending decision about a tournament.
#[derive(Debug, Clone)]
pub struct TournamentDecision {
    pub id: TournamentId,
    pub name: StageName,
    pub kind: TournamentDecisionKind,
}

/// What has to be decided about a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TournamentDecisionKind {
    /// Rerun this many games, which are void or failed by a platform fault.
    Rerun { games: usize },
    /// Start the next round.
    StartRound,
    /// Close it: all rounds are over.
    Close,
}

/// The pending decisions about tournaments, in order of creation. A tournament without a started round has none: teams may still enter.
#[boxed_future]
pub async fn of_tournaments(app: &AppState) -> Result<Vec<TournamentDecision>, Problem> {
    let mut decisions = Vec::new();
    for tournament in app.store.tournaments().await? {
        if tournament.closed_at.is_some() {
            continue;
        }
        let state = TournamentState::without_standings(app, tournament.id).await?;
        if let Some(kind) = of_tournament(&state) {
            decisions.push(TournamentDecision {
                id: tournament.id,
                name: tournament.name,
                kind,
            });
        }
    }
    Ok(decisions)
}

/// The pending decision about a tournament; `None` also without a started round.
pub fn of_tournament(state: &TournamentState) -> Option<TournamentDecisionKind> {
    let to_rerun = state.games.iter().filter(|game| {
        let is_void_or_failed = matches!(
            game.state,
            GameState::Void { .. } | GameState::PlatformFailed { .. }
        );
        state.needs_result(game) && is_void_or_failed
    });
    match (tournament::phase(state), to_rerun.count()) {
        (TournamentPhase::Closed, _) => None,
        (_, games @ 1..) => Some(TournamentDecisionKind::Rerun { games }),
        (TournamentPhase::BetweenRounds, 0) => Some(TournamentDecisionKind::StartRound),
        (TournamentPhase::AllRoundsPlayed, 0) => Some(TournamentDecisionKind::Close),
        (TournamentPhase::Open | TournamentPhase::RoundRunning, 0) => None,
    }
}

/// Evaluations of a day that have no result through no fault of the agent, and that nothing has replaced yet.
pub fn evaluations_to_rerun(evaluations: &[Evaluation]) -> impl Iterator<Item = &Evaluation> {
    let replaced: BTreeSet<EvaluationId> = evaluations
        .iter()
        .filter_map(|evaluation| evaluation.rerun_of)
        .collect();
    evaluations.iter().filter(move |evaluation| {
        let has_no_result = matches!(
            evaluation.state,
            EvaluationState::PlatformFailed { .. } | EvaluationState::DeadlineMissed { .. }
        );
        has_no_result && evaluation.voided.is_none() && !replaced.contains(&evaluation.id)
    })
}

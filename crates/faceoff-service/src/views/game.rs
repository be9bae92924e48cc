//! Games between two submissions: purpose (a round of a tournament, a test, a friendly game), state and result.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{tournament_state::TournamentState, visibility::GameVisibility},
};
use faceoff_api::views::{
    game::{GameResultView, GameSideView, GameStatus, GameView, PurposeView, RecordingView},
    printable,
};
use faceoff_scoring::tournament::{GameScore, PlayedGame, Side as TableSide};
use faceoff_store::{
    Game, GameFilter, GamePurpose, GameRecording, GameState, ScheduleEntry, StoreError,
};
use faceoff_types::{GameId, RoundNumber, Side, TournamentId};

/// A game that the viewer may see, with the state of its tournament, without draws and results.
///
/// # Errors
/// `NotFound`, also for a game that the viewer may not see.
#[boxed_future]
pub async fn find_visible(
    app: &AppState,
    viewer: Viewer,
    id: GameId,
) -> Result<(TournamentState, Game), Problem> {
    let not_found = || Problem::new(ProblemKind::NotFound, GAME_NOT_FOUND);
    let game = match app.store.game(id).await {
        Err(StoreError::NotFound(_)) => return Err(not_found()),
        result => result?,
    };
    let state = TournamentState::without_standings(app, game.tournament).await?;
    if state.visibility(viewer).is_visible(&game) {
        Ok((state, game))
    } else {
        Err(not_found())
    }
}

/// Message for a game that does not exist or that the viewer may not see.
const GAME_NOT_FOUND: &str = "there is no such game, or you may not see it; check the id. Test and friendly games are visible only \
                       to their two teams: check the token";

/// A game that the viewer may see.
#[boxed_future]
pub async fn find(app: &AppState, viewer: Viewer, id: GameId) -> Result<GameView, Problem> {
    let (state, game) = find_visible(app, viewer, id).await?;
    view(&state, viewer, &game)
}

/// The games of all rounds, or of one, in the order in which they are played.
pub fn round_games(
    state: &TournamentState,
    viewer: Viewer,
    round: Option<RoundNumber>,
) -> Result<Vec<GameView>, Problem> {
    let is_selected = |game: &&Game| {
        round.is_none()
            || game
                .purpose
                .schedule_entry()
                .map(|schedule_entry| schedule_entry.round)
                == round
    };
    let games = state.games.iter().filter(is_selected);
    games.map(|game| view(state, viewer, game)).collect()
}

/// The test and friendly games of a tournament that the viewer may see, newest first.
#[boxed_future]
pub async fn test_and_friendly_games(
    app: &AppState,
    viewer: Viewer,
    id: TournamentId,
) -> Result<Vec<GameView>, Problem> {
    let state = TournamentState::without_standings(app, id).await?;
    let team = match viewer {
        Viewer::Team(team) => Some(team),
        Viewer::Organiser | Viewer::Visitor => None,
    };
    let games = app
        .store
        .games(id, GameFilter::TestAndFriendly(team))
        .await?;
    let visible = games
        .iter()
        .filter(|game| state.visibility(viewer).is_visible(game));
    visible.map(|game| view(&state, viewer, game)).collect()
}

/// A game, as the viewer may see it.
pub fn view(state: &TournamentState, viewer: Viewer, game: &Game) -> Result<GameView, Problem> {
    let side = |side: Side| {
        let team = game.teams[side.index()];
        Ok::<_, Problem>(GameSideView {
            team,
            team_name: state.name(team)?,
            submission: game.submissions[side.index()],
        })
    };
    let tournament = &state.tournament;
    let excluded_by = state.excluded_by(game)?;
    Ok(GameView {
        id: game.id,
        tournament: tournament.id,
        tournament_name: tournament.name.clone(),
        purpose: purpose(state, game)?,
        sides: [side(Side::First)?, side(Side::Second)?],
        seed_label: game.seed.to_string(),
        created_at: game.created_at,
        next: next_text(state, game).to_owned(),
        excluded_by,
        status: status(state, viewer, game)?,
    })
}

fn purpose(state: &TournamentState, game: &Game) -> Result<PurposeView, Problem> {
    Ok(match game.purpose {
        GamePurpose::Round(ScheduleEntry {
            round,
            matchday,
            pairing: meeting,
            second_half,
        }) => PurposeView::Round {
            round,
            matchday,
            meeting,
            second_half,
        },
        GamePurpose::ScheduleReplay { replay, original } => PurposeView::ScheduleReplay {
            replay,
            round: original.round,
            matchday: original.matchday,
            meeting: original.pairing,
            second_half: original.second_half,
        },
        GamePurpose::Test { asked_by } => PurposeView::Test {
            requested_by: asked_by.map(|team| state.name(team)).transpose()?,
        },
        GamePurpose::Friendly { asked_by } => PurposeView::Friendly {
            requested_by: state.name(asked_by)?,
        },
    })
}

fn status(state: &TournamentState, viewer: Viewer, game: &Game) -> Result<GameStatus, Problem> {
    Ok(match &game.state {
        GameState::Queued => GameStatus::Queued,
        GameState::Running { attempt, since } => GameStatus::Running {
            attempt: *attempt,
            since: *since,
        },
        GameState::Played(stored_result) => {
            let (score, played) = state.result(game)?.ok_or_else(|| {
                Problem::internal(format_args!("game {} is played without a result", game.id))
            })?;
            let recording = stored_result.recording.as_ref();
            let recording = recording
                .map(|recording| recording_view(state.visibility(viewer), game, &score, recording));
            GameStatus::Played {
                attempt: stored_result.attempt,
                finished_at: stored_result.at,
                result: Box::new(result_view(&score, &played, recording)),
            }
        }
        GameState::PlatformFailed { at, reason } => GameStatus::PlatformFailed {
            at: *at,
            reason: printable(reason.clone()),
        },
        GameState::Void { at, reason } => GameStatus::Void {
            at: *at,
            reason: printable(reason.clone()),
        },
        GameState::Cancelled { at, reason } => GameStatus::Cancelled {
            at: *at,
            reason: printable(reason.clone()),
        },
    })
}

fn recording_view(
    visibility: GameVisibility<'_>,
    game: &Game,
    score: &GameScore,
    recording: &GameRecording,
) -> RecordingView {
    RecordingView {
        public: visibility.is_public(game),
        seed: visibility.can_see_both_sides(game).then_some(score.seed),
        game_blake3: recording.game_blake3.clone(),
        side_blake3: recording.side_blake3.clone(),
    }
}

fn result_view(
    score: &GameScore,
    played: &PlayedGame,
    recording: Option<RecordingView>,
) -> GameResultView {
    let sides = score.sides.each_ref();
    let winner = played.winner().map(|side: TableSide| side as usize);
    GameResultView {
        score: played.score(),
        goals: played.goals(),
        fouls: sides.map(|side| side.fouls),
        penalty_points: played.penalty_points(),
        tiers: sides.map(|side| side.tier),
        violations: sides.map(|side| side.violations.clone()),
        faults: sides.map(|side| side.faults),
        late_answers: sides.map(|side| side.late_answers),
        computation_time_s: sides.map(|side| side.computation_time_s),
        forfeits: played.forfeits(),
        winner: winner.map(|side| played.teams()[side].clone()),
        why: played.result().into(),
        because: played.result().to_string(),
        steps: score.steps,
        windows: score.windows,
        rallies: score.rallies,
        recording,
    }
}

/// What happens next to a game, in words.
fn next_text(state: &TournamentState, game: &Game) -> &'static str {
    let counts_in_tournament = matches!(game.purpose, GamePurpose::Round(_));
    match &game.state {
        GameState::Queued if state.tournament.paused.is_some() => {
            "It waits until the paused tournament is resumed."
        }
        GameState::Queued => {
            "It starts as soon as a slot is free; games of rounds come first, in the order of matchdays."
        }
        GameState::Running { .. } => "It is running; its result is shown at once when it ends.",
        GameState::Played(_) => "Done. Its result stays.",
        GameState::PlatformFailed { .. } if counts_in_tournament => {
            "It does not count. An organiser has to rerun it, with the same seed, before the tournament continues."
        }
        GameState::PlatformFailed { .. } => "Failed. An organiser can rerun it.",
        GameState::Void { .. } => {
            "Its result no longer counts. An organiser has to rerun it, with the same seed, before the tournament continues."
        }
        GameState::Cancelled { .. } => "It is not played.",
    }
}

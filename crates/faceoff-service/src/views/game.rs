//! A game between two submissions: what it is for, how it stands, what it came to.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{sight::GameSight, tournament_sheet::TournamentSheet},
};
use faceoff_api::views::{
    game::{GameResultView, GameSideView, GameStatus, GameView, PurposeView, RecordingView},
    shown,
};
use faceoff_scoring::tournament::{GameScore, PlayedGame, Side as TableSide};
use faceoff_store::{Game, GamePurpose, GameRecording, GameState, GamesOf, Meeting, StoreError};
use faceoff_types::{GameId, RoundNumber, Side, TournamentId};

/// A game that the viewer may know of, with its tournament, whose other games are not read. One that they may not know
/// of looks like none.
///
/// # Errors
/// `NotFound`.
#[boxed]
pub async fn known(
    app: &AppState,
    viewer: Viewer,
    id: GameId,
) -> Result<(TournamentSheet, Game), Problem> {
    let none = || Problem::new(ProblemKind::NotFound, NO_GAME);
    let game = match app.store.game(id).await {
        Err(StoreError::NotFound(_)) => return Err(none()),
        found => found?,
    };
    let sheet = TournamentSheet::unscored(app, game.tournament).await?;
    if sheet.sight(viewer).shows(&game) {
        Ok((sheet, game))
    } else {
        Err(none())
    }
}

const NO_GAME: &str = "there is no such game that you could see; check the id, and the token if it does not count: such \
                       games are their two teams' alone";

/// One that the viewer knows of.
#[boxed]
pub async fn find(app: &AppState, viewer: Viewer, id: GameId) -> Result<GameView, Problem> {
    let (sheet, game) = known(app, viewer, id).await?;
    of(&sheet, viewer, &game)
}

/// Those of a tournament's rounds, or of one round, in the order of play.
pub fn of_rounds(
    sheet: &TournamentSheet,
    viewer: Viewer,
    round: Option<RoundNumber>,
) -> Result<Vec<GameView>, Problem> {
    let is_asked = |game: &&Game| {
        round.is_none() || game.purpose.meeting().map(|meeting| meeting.round) == round
    };
    let games = sheet.games.iter().filter(is_asked);
    games.map(|game| of(sheet, viewer, game)).collect()
}

/// Those of a tournament that do not count, as far as they are the viewer's, the newest first.
#[boxed]
pub async fn free(
    app: &AppState,
    viewer: Viewer,
    id: TournamentId,
) -> Result<Vec<GameView>, Problem> {
    let sheet = TournamentSheet::unscored(app, id).await?;
    let whose = match viewer {
        Viewer::Team(team) => Some(team),
        Viewer::Organiser | Viewer::Anybody => None,
    };
    let games = app.store.games(id, GamesOf::Free(whose)).await?;
    let seen = games.iter().filter(|game| sheet.sight(viewer).shows(game));
    seen.map(|game| of(&sheet, viewer, game)).collect()
}

/// One, as the viewer sees it.
pub fn of(sheet: &TournamentSheet, viewer: Viewer, game: &Game) -> Result<GameView, Problem> {
    let side = |side: Side| {
        let team = game.teams[side.index()];
        Ok::<_, Problem>(GameSideView {
            team,
            team_name: sheet.name(team)?,
            submission: game.submissions[side.index()],
        })
    };
    let tournament = &sheet.tournament;
    let taken_out_by = sheet.taken_out_by(game)?;
    Ok(GameView {
        id: game.id,
        tournament: tournament.id,
        tournament_name: tournament.name.clone(),
        purpose: purpose(sheet, game)?,
        sides: [side(Side::First)?, side(Side::Second)?],
        seed_label: game.seed.to_string(),
        created_at: game.created_at,
        next: next(sheet, game).to_owned(),
        taken_out_by,
        status: status(sheet, viewer, game)?,
    })
}

fn purpose(sheet: &TournamentSheet, game: &Game) -> Result<PurposeView, Problem> {
    Ok(match game.purpose {
        GamePurpose::Round(Meeting {
            round,
            matchday,
            meeting,
            second_half,
        }) => PurposeView::Round {
            round,
            matchday,
            meeting,
            second_half,
        },
        GamePurpose::Replay { replay, of } => PurposeView::Replay {
            replay,
            round: of.round,
            matchday: of.matchday,
            meeting: of.meeting,
            second_half: of.second_half,
        },
        GamePurpose::Test { asked_by } => PurposeView::Test {
            asked_by: asked_by.map(|team| sheet.name(team)).transpose()?,
        },
        GamePurpose::Friendly { asked_by } => PurposeView::Friendly {
            asked_by: sheet.name(asked_by)?,
        },
    })
}

fn status(sheet: &TournamentSheet, viewer: Viewer, game: &Game) -> Result<GameStatus, Problem> {
    Ok(match &game.state {
        GameState::Queued => GameStatus::Queued,
        GameState::Running { attempt, since } => GameStatus::Running {
            attempt: *attempt,
            since: *since,
        },
        GameState::Played(row) => {
            let (score, played) = sheet.result(game)?.ok_or_else(|| {
                Problem::internal(format_args!("game {} is played without a result", game.id))
            })?;
            let recording = row.recording.as_ref();
            let recording =
                recording.map(|files| recording_view(sheet.sight(viewer), game, &score, files));
            GameStatus::Played {
                attempt: row.attempt,
                finished_at: row.at,
                result: Box::new(result_of(&score, &played, recording)),
            }
        }
        GameState::Broken { at, reason } => GameStatus::Broken {
            at: *at,
            reason: shown(reason.clone()),
        },
        GameState::Void { at, reason } => GameStatus::Void {
            at: *at,
            reason: shown(reason.clone()),
        },
        GameState::Cancelled { at, reason } => GameStatus::Cancelled {
            at: *at,
            reason: shown(reason.clone()),
        },
    })
}

fn recording_view(
    sight: GameSight<'_>,
    game: &Game,
    score: &GameScore,
    files: &GameRecording,
) -> RecordingView {
    RecordingView {
        public: sight.is_public(game),
        seed: sight.sees_both_sides(game).then_some(score.seed),
        game_blake3: files.game_blake3.clone(),
        side_blake3: files.side_blake3.clone(),
    }
}

fn result_of(
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
        violations: sides.map(|side| side.violations),
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

/// What happens next to a game, whoever asks.
fn next(sheet: &TournamentSheet, game: &Game) -> &'static str {
    let counts = matches!(game.purpose, GamePurpose::Round(_));
    match &game.state {
        GameState::Queued if sheet.tournament.paused.is_some() => {
            "It waits until the tournament goes on, which is paused."
        }
        GameState::Queued => {
            "It is played as soon as a slot is free; games of rounds come first, in the order of matchdays."
        }
        GameState::Running { .. } => "It is played to its end; then its result is told at once.",
        GameState::Played(_) => "Nothing more: its result stays.",
        GameState::Broken { .. } if counts => {
            "It counts for nobody; the organiser has it played again, on the same seed, before the tournament goes on."
        }
        GameState::Broken { .. } => "Nothing more, unless the organiser has it played again.",
        GameState::Void { .. } => {
            "Its result counts no more; the organiser has it played again, on the same seed, before the tournament goes on."
        }
        GameState::Cancelled { .. } => "Nothing more: it is not played.",
    }
}

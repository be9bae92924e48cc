//! A game between two submissions: what it is for, how it stands, what it came to.

use super::{sight::GameSight, tournament_sheet::TournamentSheet};
use crate::{
    app::AppState,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::shown,
};
use faceoff_scoring::tournament::{Forfeit, GameScore, PlayedGame, Side as TableSide, Why};
use faceoff_store::{Game, GamePurpose, GameRecording, GameState, GamesOf, Meeting, StoreError};
use faceoff_types::{
    ComputationTimeSummary, GameId, RoundNumber, Seed, Side, StageName, SubmissionId, TeamId,
    TeamName, Tier, TournamentId, ViolationCounts,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A game. Pairs are the home side's first, which moves the first robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GameView {
    /// Names the game in paths.
    pub id: GameId,
    /// By whose rules it is played.
    pub tournament: TournamentId,
    /// As the organiser named it.
    pub tournament_name: StageName,
    /// What it is for.
    #[serde(flatten)]
    pub purpose: PurposeView,
    /// Who plays, with what.
    pub sides: [GameSideView; 2],
    /// What its seed follows from, beside the season's secret; of a game that is played again the same.
    #[schema(example = "tournament/1/round/2/meeting/5")]
    pub seed_label: String,
    /// When it was queued first.
    pub created_at: Timestamp,
    /// The team by whose leaving it does not count; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken_out_by: Option<TeamName>,
    /// What happens next.
    pub next: String,
    /// How it stands.
    #[serde(flatten)]
    pub status: GameStatus,
}

/// A side of a game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct GameSideView {
    /// Which team.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// What it plays with, whatever it has active meanwhile.
    pub submission: SubmissionId,
}

/// What a game is for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "purpose", rename_all = "snake_case")]
pub enum PurposeView {
    /// It counts.
    Round {
        /// The round.
        #[schema(value_type = u32, minimum = 1, maximum = 100)]
        round: RoundNumber,
        /// From 1; the games of one can be played side by side.
        matchday: u32,
        /// From 1, in the order in which the round was drawn.
        meeting: u32,
        /// Is it the second game of a mirrored pair, with sides swapped?
        second_half: bool,
    },
    /// Against the organisers' baseline.
    Test {
        /// Who asked for it; null: an organiser.
        asked_by: Option<TeamName>,
    },
    /// Two teams, before or between rounds.
    Friendly {
        /// Who asked for it.
        asked_by: TeamName,
    },
    /// A game of the schedule, played again with another seed.
    Replay {
        /// Which time, from 1.
        replay: u32,
        /// The round of the game that is played again.
        #[schema(value_type = u32, minimum = 1, maximum = 100)]
        round: RoundNumber,
        /// Its matchday.
        matchday: u32,
        /// Its meeting.
        meeting: u32,
        /// Is it the second game of a mirrored pair?
        second_half: bool,
    },
}

/// How a game stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum GameStatus {
    /// No slot has it.
    Queued,
    /// A slot plays it.
    Running {
        /// Which attempt, from 1.
        attempt: u32,
        /// Since when.
        since: Timestamp,
    },
    /// It has a result.
    Played {
        /// The attempt that it is of.
        attempt: u32,
        /// When it was committed.
        finished_at: Timestamp,
        /// What it came to.
        result: Box<GameResultView>,
    },
    /// Our fault, given up: it has no result until it is played again.
    Broken {
        /// When.
        at: Timestamp,
        /// What went wrong.
        reason: String,
    },
    /// It had a result that counts no more: it has none until it is played again.
    Void {
        /// When.
        at: Timestamp,
        /// The organiser's words.
        reason: String,
    },
    /// It is not played: a side left, or it does not count and was called off.
    Cancelled {
        /// When.
        at: Timestamp,
        /// Why.
        reason: String,
    },
}

/// What a game came to. Pairs are the home side's first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GameResultView {
    /// The final score, which counts: points for the opponent's fouls included, 10 : 0 after a forfeit.
    pub score: [u32; 2],
    /// As played, without points for fouls.
    pub goals: [u32; 2],
    /// Of each side.
    pub fouls: [u32; 2],
    /// Over all windows of 500 steps.
    pub penalty_points: [f64; 2],
    /// What follows from the penalty points.
    pub tiers: [Tier; 2],
    /// Windows with each violation.
    pub violations: [ViolationCounts; 2],
    /// Crashes, rubbish and hard time-outs.
    pub faults: [u32; 2],
    /// Answers that came too late to take effect.
    pub late_answers: [u32; 2],
    /// Of all answers.
    pub computation_time_s: [ComputationTimeSummary; 2],
    /// What a side used up that forfeited; null: it did not.
    pub forfeits: [Option<Forfeit>; 2],
    /// Null: a draw.
    pub winner: Option<TeamName>,
    /// Why, for programs.
    #[serde(flatten)]
    pub why: Why,
    /// Why, in words.
    #[schema(example = "the other side is non-deployable; the winner did not lead")]
    pub because: String,
    /// Control steps played.
    pub steps: u32,
    /// Windows of 500 of them, a last shorter one included.
    pub windows: u32,
    /// Rallies begun.
    pub rallies: u32,
    /// Its files; null of the schedule played again.
    pub recording: Option<RecordingView>,
}

/// The files of a game that was played.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RecordingView {
    /// Is it there for everybody, without a token?
    pub public: bool,
    /// The game's own seed; null for those who do not see both sides.
    pub seed: Option<Seed>,
    /// Of `GET /games/{id}/recording`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// Of `GET /games/{id}/sides/1` and `2`.
    pub side_blake3: [String; 2],
}

/// Games against the baseline that were queued.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TestGamesView {
    /// Those that wait for a slot now.
    pub ordered: Vec<GameView>,
    /// Teams without one, where an organiser asked for several.
    pub not_ordered: Vec<NotOrdered>,
}

/// A team that does not play against the baseline now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NotOrdered {
    /// Which.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// Why.
    pub reason: String,
}

/// A game that the viewer may know of, with its tournament, whose other games are not read. One that they may not know
/// of looks like none.
///
/// # Errors
/// `NotFound`.
pub(crate) async fn known(
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

impl GameView {
    pub(crate) async fn find(app: &AppState, viewer: Viewer, id: GameId) -> Result<Self, Problem> {
        let (sheet, game) = known(app, viewer, id).await?;
        Self::of(&sheet, viewer, &game)
    }

    /// Those of a tournament's rounds, or of one round, in the order of play.
    pub(crate) fn of_rounds(
        sheet: &TournamentSheet,
        viewer: Viewer,
        round: Option<RoundNumber>,
    ) -> Result<Vec<Self>, Problem> {
        let is_asked = |game: &&Game| {
            round.is_none() || game.purpose.meeting().map(|meeting| meeting.round) == round
        };
        let games = sheet.games.iter().filter(is_asked);
        games.map(|game| Self::of(sheet, viewer, game)).collect()
    }

    /// Those of a tournament that do not count, as far as they are the viewer's, the newest first.
    pub(crate) async fn free(
        app: &AppState,
        viewer: Viewer,
        id: TournamentId,
    ) -> Result<Vec<Self>, Problem> {
        let sheet = TournamentSheet::unscored(app, id).await?;
        let whose = match viewer {
            Viewer::Team(team) => Some(team),
            Viewer::Organiser | Viewer::Anybody => None,
        };
        let games = app.store.games(id, GamesOf::Free(whose)).await?;
        let seen = games.iter().filter(|game| sheet.sight(viewer).shows(game));
        seen.map(|game| Self::of(&sheet, viewer, game)).collect()
    }

    pub(crate) fn of(
        sheet: &TournamentSheet,
        viewer: Viewer,
        game: &Game,
    ) -> Result<Self, Problem> {
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
        Ok(Self {
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
                result: Box::new(GameResultView::of(&score, &played, recording)),
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

impl GameResultView {
    fn of(score: &GameScore, played: &PlayedGame, recording: Option<RecordingView>) -> Self {
        let sides = score.sides.each_ref();
        let winner = played.winner().map(|side: TableSide| side as usize);
        Self {
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

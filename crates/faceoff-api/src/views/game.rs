//! A game between two submissions: what it is for, how it stands, what it came to.

use faceoff_scoring::tournament::{Forfeit, Why};
use faceoff_types::{
    ComputationTimeSummary, GameId, RoundNumber, Seed, StageName, SubmissionId, TeamId, TeamName,
    Tier, TournamentId, ViolationCounts,
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

//! Games between two submissions: purpose, state and result. A *meeting* is a pairing of two teams in a round. With mirrored
//! pairs it has two games, with the same seed and swapped sides.

use faceoff_scoring::tournament::{ForfeitKind, ResultReason};
use faceoff_types::{
    ComputationTimeSummary, GameId, RoundNumber, Seed, StageName, SubmissionId, TeamId, TeamName,
    Tier, TournamentId, ViolationCounts, deprecated_names,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A game. In arrays with one item per side the home side comes first; it controls the first robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct GameView {
    /// Id of the game.
    pub id: GameId,
    /// The tournament whose rules apply.
    pub tournament: TournamentId,
    /// Name of the tournament.
    pub tournament_name: StageName,
    /// Why the game is played.
    #[serde(flatten)]
    pub purpose: PurposeView,
    /// Teams and their submissions.
    pub sides: [GameSideView; 2],
    /// Label from which the game's seed derives, together with the season secret. A rerun has the same label.
    #[schema(example = "tournament/1/round/2/meeting/5")]
    pub seed_label: String,
    /// When it was first queued.
    pub created_at: Timestamp,
    /// The team whose departure excludes the game from the standings; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub excluded_by: Option<TeamName>,
    /// What happens next, in words.
    pub next: String,
    /// Its state, with the result or the reason of its failure.
    #[serde(flatten)]
    pub status: GameStatus,
}
deprecated_names!(GameView { taken_out_by => excluded_by });

/// One side of a game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct GameSideView {
    /// Id of the team.
    pub team: TeamId,
    /// The team's current name.
    pub team_name: TeamName,
    /// The submission that plays, also if the team has activated another one since.
    pub submission: SubmissionId,
}

/// Purpose of a game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self", tag = "purpose", rename_all = "snake_case")]
pub enum PurposeView {
    /// A game of a round, which counts.
    Round {
        /// The round, from 1.
        #[schema(value_type = u32, minimum = 1, maximum = 100)]
        round: RoundNumber,
        /// From 1; the games of a matchday can run in parallel.
        matchday: u32,
        /// Number of the meeting (the pairing of the two teams) in the round's draw, from 1.
        meeting: u32,
        /// Whether it is the second game of a mirrored pair, with sides swapped.
        second_half: bool,
    },
    /// A test game against the organisers' baseline.
    Test {
        /// The team that requested it; null: an organiser.
        requested_by: Option<TeamName>,
    },
    /// A friendly game of two teams, before or between rounds.
    Friendly {
        /// The team that requested it.
        requested_by: TeamName,
    },
    /// A game of a repetition of the schedule: all games of the tournament played again with other seeds.
    #[serde(rename = "replay")]
    ScheduleReplay {
        /// Number of the replay, from 1.
        replay: u32,
        /// The round of the replayed game.
        #[schema(value_type = u32, minimum = 1, maximum = 100)]
        round: RoundNumber,
        /// The matchday of the replayed game.
        matchday: u32,
        /// The meeting of the replayed game.
        meeting: u32,
        /// Whether it is the second game of a mirrored pair.
        second_half: bool,
    },
}
deprecated_names!(PurposeView { asked_by => requested_by });

/// State of a game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum GameStatus {
    /// Waiting for a slot.
    Queued,
    /// Running on a slot.
    Running {
        /// Number of the attempt, from 1.
        attempt: u32,
        /// When the attempt started.
        since: Timestamp,
    },
    /// It has a result.
    Played {
        /// The attempt that gave the result.
        attempt: u32,
        /// When the result was stored.
        finished_at: Timestamp,
        /// The result.
        result: Box<GameResultView>,
    },
    /// A platform fault. No result until the game is rerun.
    #[serde(rename = "broken")]
    PlatformFailed {
        /// When the game was given up.
        at: Timestamp,
        /// What went wrong.
        reason: String,
    },
    /// An organiser voided its result. No result until the game is rerun.
    Void {
        /// When it was voided.
        at: Timestamp,
        /// The organiser's reason.
        reason: String,
    },
    /// It is not played: a team left, or a game that does not count was cancelled.
    Cancelled {
        /// When it was cancelled.
        at: Timestamp,
        /// Why it was cancelled.
        reason: String,
    },
}

/// Result of a game. In arrays with one item per side the home side comes first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GameResultView {
    /// Final score, which counts: includes points for the opponent's fouls; after a forfeit 10 : 0, or a larger lead.
    pub score: [u32; 2],
    /// Goals, without points for fouls.
    pub goals: [u32; 2],
    /// Fouls of each side.
    pub fouls: [u32; 2],
    /// Penalty points over all windows of 500 steps.
    pub penalty_points: [f64; 2],
    /// Tiers that follow from the penalty points.
    pub tiers: [Tier; 2],
    /// Number of windows with each violation.
    pub violations: [ViolationCounts; 2],
    /// Agent faults: crashes, malformed answers and hard timeouts.
    pub faults: [u32; 2],
    /// Answers that came too late to take effect.
    pub late_answers: [u32; 2],
    /// Computation times of all answers, in seconds.
    pub computation_time_s: [ComputationTimeSummary; 2],
    /// Why a side forfeited: the limit that it exceeded; null if it did not forfeit.
    pub forfeits: [Option<ForfeitKind>; 2],
    /// The winner's name; null: a draw.
    pub winner: Option<TeamName>,
    /// Why the winner won, for API clients.
    #[serde(flatten)]
    pub why: ResultReason,
    /// Why the winner won, in words.
    #[schema(example = "the other side is non-deployable; the winner did not lead")]
    pub because: String,
    /// Control steps played.
    pub steps: u32,
    /// Windows of 500 control steps, including a shorter last one.
    pub windows: u32,
    /// Rallies started.
    pub rallies: u32,
    /// The recording; null for games of a repetition of the schedule.
    pub recording: Option<RecordingView>,
}

/// The recording of a game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RecordingView {
    /// Whether it is public, readable without a token.
    pub public: bool,
    /// The game's seed; null unless the caller may see both sides.
    pub seed: Option<Seed>,
    /// BLAKE3 hash of `GET /games/{id}/recording`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// BLAKE3 hashes of `GET /games/{id}/sides/1` and `2`.
    pub side_blake3: [String; 2],
}

/// Requested test games against the baseline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct TestGamesView {
    /// The queued games.
    pub queued: Vec<GameView>,
    /// Teams that get no test game, if an organiser asked for several.
    pub skipped: Vec<SkippedTestGame>,
}
deprecated_names!(TestGamesView { ordered => queued, not_ordered => skipped });

/// A team that gets no test game now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct SkippedTestGame {
    /// Id of the team.
    pub team: TeamId,
    /// The team's current name.
    pub team_name: TeamName,
    /// Why it gets none.
    pub reason: String,
}

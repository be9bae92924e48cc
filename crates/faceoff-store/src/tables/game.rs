//! Games of a tournament: the types of their purpose, state and result.

use faceoff_types::{GameId, GameSeedLabel, RoundNumber, SubmissionId, TeamId, TournamentId};
use jiff::Timestamp;
use serde_json::Value;

/// A game between two submissions. Pairs have the home side first, which controls the first robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Game {
    /// Part of its URLs.
    pub id: GameId,
    pub tournament: TournamentId,
    pub purpose: GamePurpose,
    pub teams: [TeamId; 2],
    pub submissions: [SubmissionId; 2],
    /// Label from which its seed derives.
    pub seed: GameSeedLabel,
    /// When it was first queued.
    pub created_at: Timestamp,
    pub state: GameState,
}

/// The purpose of a game.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GamePurpose {
    /// A game of a round, which counts.
    Round(ScheduleEntry),
    /// A test game against the organisers' baseline, which is the away side.
    Test {
        /// The team that requested it; `None`: an organiser.
        asked_by: Option<TeamId>,
    },
    /// A friendly game of two teams, before or between rounds.
    Friendly {
        /// The team that requested it; it counts towards this team's quota.
        asked_by: TeamId,
    },
    /// A game of a repetition of the schedule (a *replay* in the database and the API): all games of all rounds are played again with
    /// other seeds, to measure how certain the winner is.
    ScheduleReplay {
        /// Number of the repetition, from 1.
        replay: u32,
        /// The game that is repeated.
        original: ScheduleEntry,
    },
}

/// The place of a game in its tournament's schedule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScheduleEntry {
    pub round: RoundNumber,
    /// Number of the matchday in the round, from 1.
    pub matchday: u32,
    /// Number of the pairing, from 1, in the order in which the round was drawn.
    pub pairing: u32,
    /// True for the second game of a mirrored pair, with sides swapped.
    pub second_half: bool,
}

/// State of a game.
#[derive(Debug, Clone, PartialEq)]
pub enum GameState {
    Queued,
    Running {
        /// From 1.
        attempt: u32,
        /// When the attempt started.
        since: Timestamp,
    },
    /// The game has a result.
    Played(Box<StoredGameResult>),
    /// Given up after platform faults: it has no result until it is repeated.
    PlatformFailed {
        /// When it was given up.
        at: Timestamp,
        reason: String,
    },
    /// Its result was voided: it has none until it is repeated.
    Void {
        /// When it was voided.
        at: Timestamp,
        /// Public.
        reason: String,
    },
    /// It is not played: a team left the tournament, or it does not count and was cancelled.
    Cancelled {
        /// When it was cancelled.
        at: Timestamp,
        /// Public.
        reason: String,
    },
}

impl GameState {
    /// Is the game queued or running?
    #[must_use]
    pub const fn is_open(&self) -> bool {
        matches!(self, Self::Queued | Self::Running { .. })
    }
}

/// The stored result of a game.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredGameResult {
    /// The attempt that counts, from 1.
    pub attempt: u32,
    /// When it was committed.
    pub at: Timestamp,
    /// A game's `results.json`, as computed by the scoring.
    pub results: Value,
    /// Its stored files; `None` for a game of a repeated schedule.
    pub recording: Option<GameRecording>,
}

/// The stored files of a game: `game.zip`, `side-1.zip` and `side-2.zip`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameRecording {
    /// Artifact key prefix, without the slash.
    pub key: String,
    /// BLAKE3 of `game.zip`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// BLAKE3 of `side-1.zip` and `side-2.zip`; the home side is the first.
    pub side_blake3: [String; 2],
}

/// The result of playing a game, as committed by a worker.
#[derive(Debug, Clone, PartialEq)]
pub struct GameCommit {
    /// A game's `results.json`, as computed by the scoring.
    pub results: Value,
    /// Files that are stored already; `None` exactly for a game of a repeated schedule.
    pub recording: Option<GameRecording>,
    /// The tails of both agents' standard errors, with their faults.
    pub logs: [String; 2],
}

impl GamePurpose {
    pub(super) const fn stored_name(self) -> &'static str {
        match self {
            Self::Round(_) => "round",
            Self::Test { .. } => "test",
            Self::Friendly { .. } => "friendly",
            Self::ScheduleReplay { .. } => "replay",
        }
    }

    /// The game's place in the schedule; `None` for test games and friendly games.
    #[must_use]
    pub const fn schedule_entry(self) -> Option<ScheduleEntry> {
        match self {
            Self::Round(schedule_entry)
            | Self::ScheduleReplay {
                original: schedule_entry,
                ..
            } => Some(schedule_entry),
            Self::Test { .. } | Self::Friendly { .. } => None,
        }
    }

    /// Is the game's recording stored?
    #[must_use]
    pub const fn keeps_recording(self) -> bool {
        !matches!(self, Self::ScheduleReplay { .. })
    }
}

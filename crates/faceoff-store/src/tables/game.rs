//! A game on the server: what it is for, how it stands, and what it came to.

use faceoff_types::{GameId, GameSeed, RoundNumber, SubmissionId, TeamId, TournamentId};
use jiff::Timestamp;
use serde_json::Value;

/// Two submissions at one table. Pairs are the home side's first, which moves the first robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Game {
    /// Part of its URLs.
    pub id: GameId,
    pub tournament: TournamentId,
    /// What it is for.
    pub purpose: GamePurpose,
    pub teams: [TeamId; 2],
    pub submissions: [SubmissionId; 2],
    /// What its seed follows from.
    pub seed: GameSeed,
    /// When it was queued first.
    pub created_at: Timestamp,
    pub state: GameState,
}

/// What a game is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GamePurpose {
    Round(Meeting),
    /// Against the organisers' baseline, which is away.
    Test {
        /// Who asked for it; none: an organiser.
        asked_by: Option<TeamId>,
    },
    /// Two teams, before or between rounds.
    Friendly {
        /// Who asked for it, and whose quota it takes.
        asked_by: TeamId,
    },
    /// The schedule played again: how sure is its champion?
    Replay {
        /// Which time, from 1.
        replay: u32,
        /// The game that is played again.
        of: Meeting,
    },
}

/// The place of a game in its tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Meeting {
    pub round: RoundNumber,
    /// From 1.
    pub matchday: u32,
    /// From 1, in the order in which the round was drawn.
    pub meeting: u32,
    /// Is it the second game of a mirrored pair, with sides swapped?
    pub second_half: bool,
}

/// How a game stands.
#[derive(Debug, Clone, PartialEq)]
pub enum GameState {
    /// No slot has it.
    Queued,
    /// A slot plays it.
    Running {
        /// Which attempt, from 1.
        attempt: u32,
        since: Timestamp,
    },
    /// It has a result.
    Played(Box<GameResultRow>),
    /// Our fault, given up: it has no result until it is played again.
    Broken {
        at: Timestamp,
        reason: String,
    },
    /// It had a result that counts no more: it has none until it is played again.
    Void {
        at: Timestamp,
        /// As everybody may read it.
        reason: String,
    },
    /// It is not played: a side left, or it does not count and was called off.
    Cancelled {
        at: Timestamp,
        /// As everybody may read it.
        reason: String,
    },
}

impl GameState {
    /// Does it wait for a slot, or is it played?
    #[must_use]
    pub const fn is_open(&self) -> bool {
        matches!(self, Self::Queued | Self::Running { .. })
    }
}

/// What a game came to.
#[derive(Debug, Clone, PartialEq)]
pub struct GameResultRow {
    /// The attempt that counts, from 1.
    pub attempt: u32,
    /// When it was committed.
    pub at: Timestamp,
    /// The scoring's: a game's `results.json`.
    pub score: Value,
    /// Where its files are; none of a replay of the schedule.
    pub recording: Option<GameRecording>,
}

/// The stored files of a game: `game.zip`, `side-1.zip` and `side-2.zip`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameRecording {
    /// Artifact key prefix, without the slash.
    pub key: String,
    /// BLAKE3 of `game.zip`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// Of the sides' own files, the home side's first.
    pub side_blake3: [String; 2],
}

/// What playing a game yields.
#[derive(Debug, Clone, PartialEq)]
pub struct GameCommit {
    /// The scoring's: a game's `results.json`.
    pub score: Value,
    /// Uploaded before; none exactly of a replay of the schedule.
    pub recording: Option<GameRecording>,
    /// The ends of both agents' standard errors, with their faults.
    pub logs: [String; 2],
}

impl GamePurpose {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Round(_) => "round",
            Self::Test { .. } => "test",
            Self::Friendly { .. } => "friendly",
            Self::Replay { .. } => "replay",
        }
    }

    /// Its place in the schedule, if it has one.
    #[must_use]
    pub const fn meeting(self) -> Option<Meeting> {
        match self {
            Self::Round(meeting) | Self::Replay { of: meeting, .. } => Some(meeting),
            Self::Test { .. } | Self::Friendly { .. } => None,
        }
    }

    /// Is its recording stored?
    #[must_use]
    pub const fn keeps_recording(self) -> bool {
        !matches!(self, Self::Replay { .. })
    }
}

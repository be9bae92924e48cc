//! Errors of a schedule.

use faceoff_types::{RoundNumber, TeamName};

/// Why a schedule or the next round is impossible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// The tournament has fewer than two teams.
    #[error("a tournament needs at least two teams, there are {0}; enter more")]
    TooFew(usize),
    /// Fewer than two finalists are left.
    #[error(
        "a final needs at least two teams, but {0} of the finalists are left; the tournament ends here"
    )]
    TooFewFinalists(usize),
    /// The tournament has too many teams.
    #[error(
        "a tournament has at most {max} teams, there are {got}; split them into several tournaments"
    )]
    TooMany {
        /// The maximum number of teams.
        max: usize,
        /// The number of teams.
        got: usize,
    },
    /// A team is listed twice.
    #[error("{0} is entered twice; enter each team once")]
    Duplicate(TeamName),
    /// A team is not an entrant.
    #[error("{team} is in {place}, but is not entered; enter the team or remove it there")]
    UnknownTeam {
        /// Name of the team.
        team: TeamName,
        /// The round, game or list that refers to it.
        place: String,
    },
    /// A game is not in the schedule.
    #[error("{home} against {away} is no game of round {round}; remove its result")]
    UnknownGame {
        /// Number of the round.
        round: u32,
        /// The home team.
        home: TeamName,
        /// The away team.
        away: TeamName,
    },
    /// A game of an earlier round has no result.
    #[error(
        "round {round} is under way: {open} of its games have no result, {home} against {away} for one; play them first"
    )]
    Unfinished {
        /// The unfinished round.
        round: RoundNumber,
        /// Number of games without a result.
        open: usize,
        /// The home team of the first such game.
        home: TeamName,
        /// The away team.
        away: TeamName,
    },
    /// The numbers of the rounds have a gap.
    #[error("expected round {expected}, got {got}; give all earlier rounds in order")]
    OutOfOrder {
        /// The expected number.
        expected: u32,
        /// The given number.
        got: RoundNumber,
    },
    /// Invalid numbers of groups or finalists.
    #[error("{0}")]
    Format(String),
}

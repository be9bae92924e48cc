use faceoff_types::{RoundNumber, TeamName};

/// Why there is no schedule, or no next round.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// A game needs two.
    #[error("a tournament needs at least two teams, there are {0}; enter more")]
    TooFew(usize),
    /// Of those who reached it too few are left.
    #[error(
        "a final needs at least two teams, there are {0} left of those who reached it; nothing more is to be played"
    )]
    TooFewFinalists(usize),
    /// More than anybody could wait for.
    #[error("a tournament has at most {most} teams, there are {got}; divide them")]
    TooMany {
        /// The most.
        most: usize,
        /// What came.
        got: usize,
    },
    /// A team that would meet itself.
    #[error("{0} is entered twice; enter each team once")]
    Duplicate(TeamName),
    /// Somebody who is not in the tournament.
    #[error("{team} is {place}, but was never entered; enter it or take it out there")]
    UnknownTeam {
        /// Who.
        team: TeamName,
        /// Where it occurs.
        place: String,
    },
    /// A game that was not to be played.
    #[error("{home} against {away} is no game of round {round}; take its result out")]
    UnknownGame {
        /// The round.
        round: u32,
        /// At home.
        home: TeamName,
        /// Away.
        away: TeamName,
    },
    /// A result is missing.
    #[error(
        "round {round} is under way: {open} of its games have no result, {home} against {away} for one; play them first"
    )]
    Unfinished {
        /// The round.
        round: RoundNumber,
        /// Games without a result.
        open: usize,
        /// At home in the first of them.
        home: TeamName,
        /// Away.
        away: TeamName,
    },
    /// Rounds have numbers without gaps.
    #[error("expected round {expected}, got {got}; give all earlier rounds in order")]
    OutOfOrder {
        /// What should have come.
        expected: u32,
        /// What came.
        got: RoundNumber,
    },
    /// Numbers that no tournament has.
    #[error("{0}")]
    Format(String),
}

//! The schedule: computes the next round from the entrants, a seed and the earlier rounds.
//!
//! A *round* consists of the games with one set of frozen submissions: a whole round robin, the groups or the final of a
//! tournament with groups, or one pairing of a Swiss tournament. In a *matchday* each team has at most one game, so that
//! its games can run in parallel. The same entrants, seed and results give the same schedule, regardless of the order of
//! the entrants.

mod entrants;
mod error;
mod format;
mod groups;
mod matching;
mod progress;
mod round;
mod round_robin;
mod swiss;
mod tables;

pub use entrants::{Entrants, MAX_ENTRANTS};
pub use error::ScheduleError;
pub use faceoff_types::TournamentFormat as Format;
pub use format::Schedule;
pub use progress::Progress;
pub use round::{Matchday, Pairing, Round};
pub use tables::{Table, TableScope};

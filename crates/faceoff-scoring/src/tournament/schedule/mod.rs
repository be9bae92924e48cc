//! Who meets whom: from the entrants, a seed and the rounds so far to the next round.
//!
//! A *round* is what is played with one set of frozen submissions: a whole round robin, the groups or
//! the final of a tournament with groups, one pairing of a Swiss tournament. In a *matchday* nobody
//! plays twice, so that its games can be played side by side. The same entrants, seed and results give the
//! same schedule, in whatever order the entrants are listed.

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
pub use tables::{Table, TableOf};

//! Skills: the decisions where the mallet moves. One module per task (`hit`, `defend`, `prepare`, and `tournament` for whole games),
//! and shared parts.

mod absorb;
mod aim;
mod defend;
mod hit;
mod prepare;
mod tournament;

pub use defend::Defend;
pub use hit::Hit;
pub use prepare::Prepare;
pub use tournament::Tournament;

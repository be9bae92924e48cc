//! Skills that control the mallet: one module per task, and shared parts.

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

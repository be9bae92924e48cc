//! One game between two agents: two sandboxed processes in lock-step → recording and report.

mod commentary;
mod lock_step;
mod report;
mod side_player;

pub use commentary::{Commentary, GameAudience, POSITION_EVERY};
pub use report::{GameObserver, GameReport, play_game, run_game, run_game_watched};

//! A game between two agents: two sandboxed processes in lock-step → recording and report.

mod live_feed;
mod lock_step;
mod report;
mod side_player;

pub use live_feed::{LiveFeed, LiveFeedSink, POSITION_INTERVAL};
pub use report::{GameObserver, GameReport, play_game, run_game, run_game_monitored};

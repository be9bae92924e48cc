//! Air hockey: its world, the ends of its episodes in words, and games of two agents.

mod arena;
mod columns;
mod end_description;
mod game_record;
mod running_game;
mod running_side;
mod world;

pub use arena::Arena;
pub use columns::{action_space, recording_columns};
pub use end_description::describe_end;
pub use game_record::{
    Effect, GameSink, GameStepRow, RallyEnding, RallyEntry, RallyRow, RallyStart, Response,
    SideFault, SideStep,
};
pub use running_game::{FinishedGame, RunningGame};
pub use world::AirHockeyWorld;

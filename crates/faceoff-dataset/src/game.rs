//! Recordings of games, in which two agents (the *sides*) play a series of rallies against each other: writing during the
//! game, the archive of the game and of each side, reading, and verification by simulating the game again.

mod archive;
mod conditions;
mod course;
mod files;
mod rallies;
mod recorded_inputs;
mod recorder;
mod recording;
mod replay;
mod rows;
mod table;
mod verify;
mod violations;

pub use archive::{GameArchives, RecordedGame, remove_game};
pub use conditions::game_simulation_setup;
pub use course::{GameCourse, GamePositions, SideCourse};
pub use files::{GAME_FILE, GAME_FILES, side_file};
pub use rallies::ListedRally;
pub use recorder::GameRecorder;
pub use recording::GameRecording;
pub use verify::{VerifiedGame, verify_game};
pub use violations::Violation;

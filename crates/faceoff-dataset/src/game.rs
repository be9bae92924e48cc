//! Recordings of games: writing during the game, the archive and each side's archive, reading, and verification.

mod archive;
mod files;
mod recorded_inputs;
mod recorder;
mod recording;
mod replay;
mod rows;
mod table;
mod verify;

pub use archive::{GameArchives, RecordedGame, remove_game};
pub use files::{GAME_FILE, GAME_FILES, side_file};
pub use recorder::GameRecorder;
pub use recording::GameRecording;
pub use verify::{VerifiedGame, verify_game};

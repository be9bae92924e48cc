//! Recordings of games: writing one as it is played, its archive and each side's own file, reading it, and
//! verifying it.

mod archive;
mod files;
mod given;
mod recorder;
mod recording;
mod replay;
mod rows;
mod table;
mod verify;

pub use archive::{GameArchives, RecordedGame, clear_game};
pub use files::{GAME_FILE, GAME_FILES, side_file};
pub use recorder::GameRecorder;
pub use recording::GameRecording;
pub use verify::{VerifiedGame, verify_game};

//! What the files of a game are called.

use faceoff_types::Side;

/// The whole recording in the folder that `faceoff play` writes.
pub const GAME_FILE: &str = "game.zip";
/// What replays of the game are drawn from.
pub(super) const CLIPS_FILE: &str = "clips";
pub(super) const MOTION_FILE: &str = "motion.parquet";
pub(super) const RALLIES_FILE: &str = "rallies.parquet";
/// What happened: all that scoring needs but the times.
pub(super) const OUTCOME_FILE: &str = "outcome.json";
/// What one side did, in its own file.
pub(super) const SIDE_OUTCOME_FILE: &str = "side.json";

/// A side's own file in the folder that `faceoff play` writes.
#[must_use]
pub const fn side_file(side: Side) -> &'static str {
    match side {
        Side::First => "side-1.zip",
        Side::Second => "side-2.zip",
    }
}

/// The files of a recorded game.
pub const GAME_FILES: [&str; 4] = [
    GAME_FILE,
    side_file(Side::First),
    side_file(Side::Second),
    CLIPS_FILE,
];

/// What a side saw and did.
pub(super) const fn steps_file(side: Side) -> &'static str {
    match side {
        Side::First => "side-1.parquet",
        Side::Second => "side-2.parquet",
    }
}

/// How a side got ready for each rally.
pub(super) const fn entries_file(side: Side) -> &'static str {
    match side {
        Side::First => "entries-1.parquet",
        Side::Second => "entries-2.parquet",
    }
}

/// The end of a side's standard error.
pub(super) const fn log_file(side: Side) -> &'static str {
    match side {
        Side::First => "agent-1.log",
        Side::Second => "agent-2.log",
    }
}

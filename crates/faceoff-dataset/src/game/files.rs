//! File names of a recorded game.

use faceoff_types::Side;

/// The whole recording in the folder that `faceoff play` writes.
pub const GAME_FILE: &str = "game.zip";
/// Pack of clips (compact recordings of 500 control steps each) for replays of the game in the browser.
pub(super) const CLIPS_FILE: &str = "clips";
/// True motion of the puck and both robots in each control step.
pub(super) const MOTION_FILE: &str = "motion.parquet";
/// A row per rally: the play from a serve to a goal or another end.
pub(super) const RALLIES_FILE: &str = "rallies.parquet";
/// The outcome: all data for scoring except the times.
pub(super) const OUTCOME_FILE: &str = "outcome.json";
/// The outcome of one side, in its own archive.
pub(super) const SIDE_OUTCOME_FILE: &str = "side.json";

/// A side's own archive in the folder that `faceoff play` writes.
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

/// Observations and actions of a side.
pub(super) const fn steps_file(side: Side) -> &'static str {
    match side {
        Side::First => "side-1.parquet",
        Side::Second => "side-2.parquet",
    }
}

/// How a side entered each rally: the start of its agent, if necessary, and the agent's reset.
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

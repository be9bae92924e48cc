//! Tests of the `faceoff` program.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod archive;
mod command_line;
mod compare;
mod dataset;
mod eval;
mod init;
mod new;
mod play;
mod replay;
mod sim;

/// A configuration with generous time limits, so that a busy machine causes no agent faults.
const LONG_TIME_LIMITS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/long_time_limits.toml"
);

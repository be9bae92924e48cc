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
mod program;
mod replay;
mod replay_game;
mod replay_video;
mod sim;

//! The program as a team calls it.
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

/// A configuration that gives agents time: what is played again must not differ by a busy machine's faults.
const PATIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/patient.toml");

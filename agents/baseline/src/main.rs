//! Runs the agent over standard input and output.

use std::process::ExitCode;

use baseline::Baseline;
use striker::protocol;

fn main() -> ExitCode {
    let name = [env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")];
    protocol::run(name, Baseline::new)
}

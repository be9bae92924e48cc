//! Runs the agent over standard input and output.

use std::process::ExitCode;

use striker::{Agent, protocol};

fn main() -> ExitCode {
    let name = [env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")];
    protocol::run(name, Agent::new)
}

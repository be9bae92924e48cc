//! Runs the agent: messages of the evaluator's protocol come on standard input, answers go to standard output.

use std::process::ExitCode;

use striker::{Agent, protocol};

fn main() -> ExitCode {
    let name_and_version = [env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")];
    protocol::run(name_and_version, Agent::new)
}

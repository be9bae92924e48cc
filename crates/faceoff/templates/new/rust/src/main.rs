//! An agent that speaks the Faceoff protocol over standard input and output.

mod mallet;
mod policy;
mod puck;

use faceoff_agent::{AgentInfo, Interpolation};
use policy::Policy;
use std::process::ExitCode;

/// With [`Interpolation::Cubic`], an action is the joints' positions and velocities at the end of the step.
const AGENT_INFO: AgentInfo = AgentInfo {
    name: env!("CARGO_PKG_NAME"),
    version: env!("CARGO_PKG_VERSION"),
    interpolation: Interpolation::Cubic,
};

fn main() -> ExitCode {
    faceoff_agent::run(AGENT_INFO, |hello| Policy::new(&hello.env))
}

#[cfg(test)]
mod tests;

//! Speaks the agent protocol over standard input and output.

mod mallet;
mod policy;
mod puck;

use faceoff_agent::{About, Interpolation};
use policy::Policy;
use std::process::ExitCode;

/// Interpolation 3: an action is the joints' positions and velocities at the end of the step.
const ABOUT: About = About {
    name: env!("CARGO_PKG_NAME"),
    version: env!("CARGO_PKG_VERSION"),
    interpolation: Interpolation::Cubic,
};

fn main() -> ExitCode {
    faceoff_agent::run(ABOUT, |hello| Policy::new(&hello.env))
}

#[cfg(test)]
mod tests;

//! The agent's side of the protocol, for any [`Policy`].

use std::process::ExitCode;

use faceoff_agent::{About, Action, Agent, Failure, Interpolation, Observation};

use crate::{Env, Policy, Task};

/// A policy as the conversation knows it.
struct Speaking<P>(P);

impl<P: Policy> Agent for Speaking<P> {
    fn reset(&mut self) {
        self.0.reset();
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
        Ok(Action::PositionVelocity(
            self.0.act(observation.as_slice())?,
        ))
    }
}

/// Lets the policy that `make` makes answer the evaluator over standard input and output. `name` and `version` are
/// what the program calls itself.
pub fn run<P: Policy>(
    [name, version]: [&'static str; 2],
    make: impl Fn(Task, &Env) -> P,
) -> ExitCode {
    let about = About {
        name,
        version,
        interpolation: Interpolation::Cubic,
    };
    faceoff_agent::run(about, |hello| Speaking(make(hello.task, &hello.env)))
}

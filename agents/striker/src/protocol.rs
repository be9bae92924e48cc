//! The agent's side of the evaluator's protocol, for any [`Policy`].

use std::process::ExitCode;

use faceoff_agent::{Action, Agent, AgentInfo, Failure, Interpolation, Observation};

use crate::{Env, Policy, Task};

/// Adapter from a [`Policy`] to the protocol loop's [`Agent`].
struct PolicyAgent<P>(P);

impl<P: Policy> Agent for PolicyAgent<P> {
    fn reset(&mut self) {
        self.0.reset();
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
        Ok(Action::PositionVelocity(
            self.0.act(observation.as_slice())?,
        ))
    }
}

/// Creates a policy with `make_policy` for each `hello` and runs it over standard input and output. `name` and `version` identify the
/// program.
pub fn run<P: Policy>(
    [name, version]: [&'static str; 2],
    make_policy: impl Fn(Task, &Env) -> P,
) -> ExitCode {
    let info = AgentInfo {
        name,
        version,
        interpolation: Interpolation::Cubic,
    };
    faceoff_agent::run(info, |hello| {
        PolicyAgent(make_policy(hello.task, &hello.env))
    })
}

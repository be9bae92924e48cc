//! A rule-based opponent of about the strength of the 2023 challenge's baseline agent.
//!
//! The paper about that challenge describes its agent as typical approaches, planning and optimisation, that work well in the
//! ideal simulator and badly outside of it. This agent shares only that description: it predicts the puck, chooses
//! a skill (defend, hit, prepare) by rules, plans one motion and carries it out without corrections. It does not have the
//! strengths of [`striker`]: corrections of a running strike, the choice among many shots, and cushioning, which is a retreat of
//! the mallet at contact that stops the puck.

mod defend;
mod guard;
mod hit;
mod prepare;
mod tactics;

use striker::{Action, Body, Env, Policy, Task, WrongLength};
use tactics::Tactics;

/// The agent: everything between an observation and an action.
#[derive(Debug, Clone)]
pub struct Baseline {
    task: Task,
    body: Body,
    tactics: Tactics,
}

impl Baseline {
    /// An agent for `task` and the environment that the evaluator sends in the message `hello`.
    #[must_use]
    pub fn new(task: Task, env: &Env) -> Self {
        Self {
            task,
            body: Body::new(task, env),
            tactics: Tactics::new(task),
        }
    }
}

impl Policy for Baseline {
    fn reset(&mut self) {
        self.body.reset();
        self.tactics = Tactics::new(self.task);
    }

    fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength> {
        let command = self.tactics.decide(&self.body.observe(observation)?);
        Ok(self.body.follow(&command))
    }

    fn describe(&self) -> String {
        format!("{:?}", self.tactics)
    }
}

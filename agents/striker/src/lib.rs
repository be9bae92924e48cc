//! Striker: a reference agent for Robot Air Hockey.
//!
//! Model based, no learning: a Kalman filter estimates the puck, a skill chooses the mallet's target
//! position and velocity, a polynomial of degree five makes the motion smooth, and inverse kinematics with an online
//! correction converts it to joint commands within the evaluator's limits. The library has no clock
//! and no I/O; `main.rs` adds the protocol.

pub mod arm;
mod body;
mod contact;
mod env;
mod estimator;
pub mod field;
mod keeper;
mod kinematics;
pub mod motion;
mod pendulum;
mod policy;
pub mod protocol;
pub mod puck;
mod redundancy;
pub mod scene;
mod skills;
#[cfg(test)]
mod testing;

use scene::{MalletCommand, Scene};
use skills::{Defend, Hit, Prepare, Tournament};

pub use body::Body;
pub use env::{BaseFrame, Env, JOINTS, Joints, RadiusInfo, RobotInfo, TableInfo};
pub use kinematics::{Pose, forward};
pub use policy::{Action, Policy, Task, WrongLength};

/// The kind of play for the task: each skill decides where the mallet moves.
#[derive(Debug, Clone)]
enum Skill {
    Hit(Hit),
    Defend(Defend),
    Prepare(Prepare),
    Tournament(Tournament),
}

impl Skill {
    fn new(task: Task) -> Self {
        match task {
            Task::Hit => Self::Hit(Hit::new()),
            Task::Defend => Self::Defend(Defend::new()),
            Task::Prepare => Self::Prepare(Prepare::new()),
            Task::Tournament => Self::Tournament(Tournament::new()),
        }
    }

    fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self {
            Self::Hit(skill) => skill.decide(scene),
            Self::Defend(skill) => skill.decide(scene),
            Self::Prepare(skill) => skill.decide(scene),
            Self::Tournament(skill) => skill.decide(scene),
        }
    }
}

/// The agent: everything between an observation and an action.
#[derive(Debug, Clone)]
pub struct Agent {
    task: Task,
    body: Body,
    skill: Skill,
}

impl Agent {
    /// An agent for `task` and the environment that the evaluator sends in the message `hello`.
    #[must_use]
    pub fn new(task: Task, env: &Env) -> Self {
        Self {
            task,
            body: Body::new(task, env),
            skill: Skill::new(task),
        }
    }
}

impl Policy for Agent {
    fn reset(&mut self) {
        self.body.reset();
        self.skill = Skill::new(self.task);
    }

    fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength> {
        let command = self.skill.decide(&self.body.observe(observation)?);
        Ok(self.body.follow(&command))
    }

    fn describe(&self) -> String {
        format!("{:?}", self.skill)
    }
}

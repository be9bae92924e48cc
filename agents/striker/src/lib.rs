//! Striker: a reference agent for Robot Air Hockey.
//!
//! Model based, no learning: a Kalman filter estimates the puck, a skill decides where the mallet
//! shall be and how fast it shall move there, a quintic makes that smooth, and inverse kinematics
//! with a learnt correction turns it into joint commands within the evaluator's limits. The library
//! is free of clocks and I/O; `main.rs` adds the protocol.

mod arm;
mod contact;
mod env;
mod estimator;
mod field;
mod keeper;
mod kinematics;
mod motion;
mod opponent;
pub mod protocol;
mod puck;
mod redundancy;
mod skills;
#[cfg(test)]
mod testing;

use arm::Arm;
use estimator::{Estimator, MalletState, PuckObservation};
use field::{Field, Vec2};
use keeper::Keeper;
use motion::Motion;
use skills::{Defend, Hit, Order, Prepare, Scene, Tournament};

pub use env::{BaseFrame, Env, JOINTS, Joints, RadiusInfo, RobotInfo, TableInfo};
pub use kinematics::{Pose, forward};

/// Which behaviour is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Score against a swinging opponent.
    Hit,
    /// Stop an incoming puck.
    Defend,
    /// Free the puck from the rim.
    Prepare,
    /// Play a whole game.
    Tournament,
}

/// Positions, then velocities, of the seven joints (the protocol's interpolation 3).
pub type Action = [[f64; JOINTS]; 2];

#[derive(Debug, Clone)]
enum Skill {
    Hit(Hit),
    Defend(Defend),
    Prepare(Prepare),
    Tournament(Tournament),
}

/// The agent: everything between an observation and an action.
#[derive(Debug, Clone)]
pub struct Agent {
    task: Task,
    dt: f64,
    field: Field,
    arm: Arm,
    estimator: Estimator,
    keeper: Keeper,
    skill: Skill,
    mallet: Motion,
    step: u32,
}

impl Agent {
    /// An agent for `task` in the environment that the evaluator described.
    #[must_use]
    pub fn new(task: Task, env: &Env) -> Self {
        let field = Field::new(env);
        Self {
            task,
            dt: env.dt,
            arm: Arm::new(env),
            estimator: Estimator::new(&field, env.dt),
            keeper: Keeper::Nobody,
            skill: new_skill(task),
            mallet: Motion::rest(Vec2::zeros()),
            step: 0,
            field,
        }
    }

    /// Starts a new episode or rally.
    pub fn reset(&mut self) {
        self.estimator.reset();
        self.keeper = Keeper::Nobody;
        self.skill = new_skill(self.task);
        self.step = 0;
    }

    /// The action for an observation of 20 or 23 numbers (robot base frame).
    ///
    /// # Errors
    /// If the observation has another length.
    pub fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength> {
        if observation.len() != 20 && observation.len() != 23 {
            return Err(WrongLength(observation.len()));
        }
        let q = Joints::from_column_slice(&observation[6..13]);
        let dq = Joints::from_column_slice(&observation[13..20]);
        let time = f64::from(self.step) * self.dt;
        let pose = forward(&q);
        let tip_velocity = pose.jacobian * dq;
        let seen = MalletState {
            pos: self.field.to_field(Vec2::new(pose.tip.x, pose.tip.y)),
            vel: Vec2::new(tip_velocity.x, tip_velocity.y),
        };
        if self.step == 0 {
            self.arm.reset(&q);
            self.mallet = Motion::rest(seen.pos);
        } else {
            self.arm.observe(&q);
        }
        let o = observation;
        let puck = self.estimator.observe(
            &PuckObservation {
                pose: [o[0] - self.field.base, o[1], o[2]],
                velocity: [o[3], o[4], o[5]],
            },
            seen,
        );
        if let [x, y, _] = o[20..] {
            let seen = self.field.to_field(Vec2::new(x, y));
            let in_game = self.task == Task::Tournament;
            self.keeper
                .observe(&self.field, in_game, time, self.dt, seen);
        }
        let scene = Scene {
            field: &self.field,
            dt: self.dt,
            time,
            puck,
            puck_speed_deviation: self.estimator.speed_deviation(),
            mallet: self.mallet,
            arm: &self.arm,
            keeper: &self.keeper,
        };
        let order = match &mut self.skill {
            Skill::Hit(s) => s.decide(&scene),
            Skill::Defend(s) => s.decide(&scene),
            Skill::Prepare(s) => s.decide(&scene),
            Skill::Tournament(s) => s.decide(&scene),
        };
        self.follow(&order);
        self.step += 1;
        Ok(self.arm.action())
    }

    /// What it is doing, for a log.
    #[must_use]
    pub fn describe(&self) -> String {
        format!("{:?}", self.skill)
    }

    /// Moves the references on by one control step.
    fn follow(&mut self, order: &Order) {
        let before = self.mallet;
        let mut next = before.towards(&order.target, self.dt);
        next.limit(&before, self.dt, order.acceleration);
        next.confine(&before, self.dt, &self.field);
        let reached = self
            .arm
            .advance(self.field.to_base(next.pos), next.vel, order.posture);
        // Where limits cut the motion, go on from what is possible.
        if (reached.velocity - next.vel).norm() > 0.02 {
            next.vel = reached.velocity;
            next.acc = Vec2::zeros();
        }
        next.pos = self.field.to_field(reached.position);
        self.mallet = next;
    }
}

fn new_skill(task: Task) -> Skill {
    match task {
        Task::Hit => Skill::Hit(Hit::new()),
        Task::Defend => Skill::Defend(Defend::new()),
        Task::Prepare => Skill::Prepare(Prepare::new()),
        Task::Tournament => Skill::Tournament(Tournament::new()),
    }
}

/// An observation of a length that the protocol does not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongLength(usize);

impl std::fmt::Display for WrongLength {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "expected an observation of 20 or 23 numbers, got {}",
            self.0
        )
    }
}

impl std::error::Error for WrongLength {}

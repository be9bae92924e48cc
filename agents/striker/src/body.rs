//! The *body* of an agent: sensing and motion without decisions. It estimates the state of the table from observations, and moves the
//! mallet as commanded.

use crate::arm::Arm;
use crate::env::{Env, Joints};
use crate::estimator::{Estimator, MalletState, PuckObservation};
use crate::field::{Field, Vec2};
use crate::keeper::Keeper;
use crate::kinematics::forward;
use crate::motion::Motion;
use crate::policy::{Action, Task, WrongLength};
use crate::scene::{MalletCommand, Scene};

/// Estimates of puck and opponent, and the references (commanded motions) of arm and mallet.
#[derive(Debug, Clone)]
pub struct Body {
    task: Task,
    /// Control period, seconds.
    dt: f64,
    field: Field,
    arm: Arm,
    /// Estimates the puck.
    estimator: Estimator,
    /// The opponent's mallet.
    keeper: Keeper,
    /// Reference of the own mallet.
    mallet: Motion,
    /// Control steps since the start of the episode or rally.
    step: u32,
}

impl Body {
    /// A body for the environment that the evaluator sends in the message `hello`.
    #[must_use]
    pub fn new(task: Task, env: &Env) -> Self {
        let field = Field::new(env);
        Self {
            task,
            dt: env.dt,
            arm: Arm::new(env),
            estimator: Estimator::new(&field, env.dt),
            keeper: Keeper::Unseen,
            mallet: Motion::at_rest(Vec2::zeros()),
            step: 0,
            field,
        }
    }

    /// Starts a new episode or rally.
    pub fn reset(&mut self) {
        self.estimator.reset();
        self.keeper = Keeper::Unseen;
        self.step = 0;
    }

    /// Updates the estimates with an observation in the robot's base frame: 20 numbers, or 23 with an opponent on the table.
    ///
    /// # Errors
    /// If the observation has another length.
    pub fn observe(&mut self, observation: &[f64]) -> Result<Scene<'_>, WrongLength> {
        if observation.len() != 20 && observation.len() != 23 {
            return Err(WrongLength(observation.len()));
        }
        let q = Joints::from_column_slice(&observation[6..13]);
        let dq = Joints::from_column_slice(&observation[13..20]);
        let time = f64::from(self.step) * self.dt;
        let pose = forward(&q);
        let tip_velocity = pose.jacobian * dq;
        let own_mallet = MalletState {
            pos: self.field.to_field(Vec2::new(pose.tip.x, pose.tip.y)),
            vel: Vec2::new(tip_velocity.x, tip_velocity.y),
        };
        if self.step == 0 {
            self.arm.reset(&q);
            self.mallet = Motion::at_rest(own_mallet.pos);
        } else {
            self.arm.observe(&q);
        }
        let puck = self.estimator.observe(
            &PuckObservation {
                pose: [
                    observation[0] - self.field.base_distance,
                    observation[1],
                    observation[2],
                ],
                velocity: [observation[3], observation[4], observation[5]],
            },
            own_mallet,
        );
        if let [x, y, _] = observation[20..] {
            let opponent_mallet = self.field.to_field(Vec2::new(x, y));
            let in_game = self.task == Task::Tournament;
            self.keeper
                .observe(&self.field, in_game, time, self.dt, opponent_mallet);
        }
        Ok(Scene {
            field: &self.field,
            dt: self.dt,
            time,
            puck,
            puck_velocity_deviation: self.estimator.velocity_deviation(),
            mallet: self.mallet,
            arm: &self.arm,
            keeper: &self.keeper,
        })
    }

    /// Advances the references by one control step according to `command`, and returns the action.
    pub fn follow(&mut self, command: &MalletCommand) -> Action {
        let before = self.mallet;
        let mut next = before.towards(&command.target, self.dt);
        next.limit(&before, self.dt, command.acceleration);
        next.confine(&before, self.dt, &self.field);
        let reached = self
            .arm
            .advance(self.field.to_base(next.pos), next.vel, command.posture);
        // Where limits shortened the motion, continue from the state that was reached.
        if (reached.velocity - next.vel).norm() > 0.02 {
            next.vel = reached.velocity;
            next.acc = Vec2::zeros();
        }
        next.pos = self.field.to_field(reached.position);
        self.mallet = next;
        self.step += 1;
        self.arm.action()
    }
}

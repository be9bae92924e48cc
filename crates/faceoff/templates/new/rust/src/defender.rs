//! Defends: meets the puck in front of the goal and retreats with it, so that it stops there.
//!
//! Positions are in the robot's base frame: x points towards the opponent's goal. Units: metres, radians, seconds.

use crate::{mallet::Mallet, puck::Puck};
use faceoff_agent::{Action, Agent, Env, Failure, Observation};

/// A puck with a smaller vx is coming towards our goal, m/s.
const INCOMING_VX: f64 = -0.3;
/// Distance from the goal line at which the mallet meets the puck, m.
const MEET_DISTANCE: f64 = 0.3;
/// A mallet that retreats at this fraction of the puck's speed stops it.
const RETREAT_RATIO: f64 = 0.31;
/// Time before the contact at which the mallet begins to retreat, s.
const RETREAT_TIME: f64 = 0.12;
/// Distance from the goal line at which the mallet waits, m.
const WAIT_DISTANCE: f64 = 0.14;

pub struct Policy {
    mallet: Mallet,
    puck: Puck,
    /// Distance of the centres of puck and mallet at a contact, m.
    contact_distance: f64,
    started: bool,
}

impl Policy {
    pub fn new(env: &Env) -> Self {
        Self {
            mallet: Mallet::new(env),
            puck: Puck::new(env),
            contact_distance: env.puck.radius + env.mallet.radius,
            started: false,
        }
    }
}

impl Agent for Policy {
    fn reset(&mut self) {
        self.puck.reset();
        self.started = false;
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
        let mallet = &mut self.mallet;
        if !self.started {
            mallet.reset(observation.joint_positions());
            self.started = true;
        }
        self.puck.observe(observation.puck());
        let puck = self.puck.state;

        if puck.vx > INCOMING_VX {
            // The puck is no danger: wait in front of the goal, on the puck's side.
            let wait_y = (0.3 * puck.y).clamp(-0.1, 0.1);
            return Ok(mallet.move_to([mallet.goal + WAIT_DISTANCE, wait_y], 1.0));
        }
        let gap = (puck.x - mallet.x).hypot(puck.y - mallet.y) - self.contact_distance;
        if gap < RETREAT_TIME * puck.speed() {
            // The contact is near: retreat in the puck's direction.
            return Ok(mallet.move_at_velocity(RETREAT_RATIO * puck.vx, RETREAT_RATIO * puck.vy));
        }
        // Move to the point where the puck will be at the meeting distance.
        let meet_x = (mallet.goal + MEET_DISTANCE).min(puck.x - self.contact_distance);
        let meet = self
            .puck
            .predict((puck.x - self.contact_distance - meet_x) / -puck.vx);
        Ok(mallet.move_to([meet_x, meet.y], 1.5))
    }
}

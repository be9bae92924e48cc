//! Defends: meets the puck in front of the goal and gives way, so that it stays there. Change anything.
//!
//! Positions are in the robot's own base frame: x grows towards the other goal; metres, radians, seconds.

use crate::{mallet::Mallet, puck::Puck};
use faceoff_agent::{Action, Agent, Env, Failure, Observation};

/// A puck with less vx comes at us, m/s.
const INCOMING: f64 = -0.3;
/// How far in front of the goal line it is met, m.
const MEET: f64 = 0.3;
/// A mallet that retreats at this share of the puck's speed takes all of it away.
const GIVE_WAY: f64 = 0.31;

pub struct Policy {
    mallet: Mallet,
    puck: Puck,
    contact: f64,
    started: bool,
}

impl Policy {
    pub fn new(env: &Env) -> Self {
        Self {
            mallet: Mallet::new(env),
            puck: Puck::new(env),
            contact: env.puck.radius + env.mallet.radius,
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
        let puck = self.puck.now;

        if puck.vx > INCOMING {
            // Nothing to do: wait in front of the goal, on the puck's side of it.
            return Ok(mallet.go([mallet.goal + 0.14, (0.3 * puck.y).clamp(-0.1, 0.1)], 1.0));
        }
        let gap = (puck.x - mallet.x).hypot(puck.y - mallet.y) - self.contact;
        if gap < 0.12 * puck.speed() {
            // It is about to touch: go back with it.
            return Ok(mallet.r#move(GIVE_WAY * puck.vx, GIVE_WAY * puck.vy));
        }
        let meet_x = (mallet.goal + MEET).min(puck.x - self.contact);
        let meet = self.puck.after((puck.x - self.contact - meet_x) / -puck.vx);
        Ok(mallet.go([meet_x, meet.y], 1.5))
    }
}

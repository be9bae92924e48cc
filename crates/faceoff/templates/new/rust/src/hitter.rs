//! Shoots the puck at the opponent's goal: moves behind the puck, accelerates along a line and brakes.
//!
//! Positions are in the robot's base frame: x points towards the opponent's goal. Units: metres, radians, seconds.

use crate::{mallet::Mallet, puck::Puck};
use faceoff_agent::{Action, Agent, Env, Failure, Observation};

/// Speed of the mallet in a shot, m/s.
const SHOT_SPEED: f64 = 1.6;
/// Distance over which the mallet accelerates to that speed, m.
const RUN_UP: f64 = 0.16;
/// The agent waits while the puck is faster than this, m/s.
const WAIT_SPEED: f64 = 0.35;
/// Distance from the goal line at which the mallet waits, m.
const WAIT_DISTANCE: f64 = 0.14;
/// Longest shot, control steps.
const MAX_SHOT_STEPS: u32 = 20;
/// Speed towards the line of the shot per distance from it, 1/s.
const SIDEWAYS_GAIN: f64 = 6.0;

/// A shot: its direction, and the remaining control steps.
struct Shot {
    dx: f64,
    dy: f64,
    steps_left: u32,
}

pub struct Policy {
    mallet: Mallet,
    puck: Puck,
    /// Distance of the centres of puck and mallet at a contact, m.
    contact_distance: f64,
    /// x of the table's centre, m.
    middle: f64,
    /// x of the opponent's goal line, m.
    opponent_goal: f64,
    started: bool,
    /// The current shot.
    shot: Option<Shot>,
}

impl Policy {
    pub fn new(env: &Env) -> Self {
        let middle = env.robot.base_distance_m().unwrap_or(1.51);
        Self {
            middle,
            opponent_goal: middle + env.table.length / 2.0,
            mallet: Mallet::new(env),
            puck: Puck::new(env),
            contact_distance: env.puck.radius + env.mallet.radius,
            started: false,
            shot: None,
        }
    }

    /// One step of a shot, or a braking step once it has ended.
    fn shoot(&mut self, Shot { dx, dy, steps_left }: Shot) -> Action {
        let (mallet, puck) = (&mut self.mallet, self.puck.state);
        // Distance from mallet to puck in the shot's direction; negative once the puck is behind the mallet.
        let ahead = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy;
        if steps_left == 0 || ahead < 0.0 {
            return mallet.move_at_velocity(0.0, 0.0);
        }
        // After the contact, two more steps are enough.
        let steps_left = if ahead < self.contact_distance + 0.005 {
            steps_left.min(2)
        } else {
            steps_left
        };
        self.shot = Some(Shot {
            dx,
            dy,
            steps_left: steps_left - 1,
        });
        // Follow the puck sideways, because it may be rolling.
        let across = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy;
        let sideways = SIDEWAYS_GAIN * across;
        mallet.move_at_velocity(
            SHOT_SPEED * dx - sideways * dy,
            SHOT_SPEED * dy + sideways * dx,
        )
    }

    /// The target point, or a point beside the puck if the direct path would touch it.
    fn waypoint(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (mallet, puck, clearance) =
            (&self.mallet, self.puck.state, self.contact_distance + 0.02);
        let distance = (x - mallet.x).hypot(y - mallet.y).max(1e-6);
        let (dx, dy) = ((x - mallet.x) / distance, (y - mallet.y) / distance);
        let along = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy;
        // The puck's offset to the left of the path.
        let left = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy;
        if along < 0.0 || along > distance + clearance || left.abs() > clearance {
            return [x, y];
        }
        // Pass the puck on the nearer side, or on the other one if the rim is in the way.
        let near_side = if left > 0.0 { -1.0 } else { 1.0 };
        [near_side, -near_side]
            .map(|side| {
                [
                    puck.x - side * dy * (clearance + 0.03),
                    puck.y + side * dx * (clearance + 0.03),
                ]
            })
            .into_iter()
            .find(|beside| mallet.nearest_allowed(beside[0], beside[1]) == *beside)
            .unwrap_or([x, y])
    }
}

impl Agent for Policy {
    fn reset(&mut self) {
        self.puck.reset();
        self.started = false;
        self.shot = None;
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
        if !self.started {
            self.mallet.reset(observation.joint_positions());
            self.started = true;
        }
        self.puck.observe(observation.puck());
        if let Some(shot) = self.shot.take() {
            return Ok(self.shoot(shot));
        }
        let (mallet, puck) = (&mut self.mallet, self.puck.state);
        if puck.speed() > WAIT_SPEED || puck.x > self.middle - 0.15 {
            // The puck is too fast or too far away: wait in front of the goal, on the puck's side.
            let wait_y = (0.3 * puck.y).clamp(-0.1, 0.1);
            return Ok(mallet.move_to([mallet.goal + WAIT_DISTANCE, wait_y], 1.0));
        }
        // Start behind the puck, on the line from the centre of the opponent's goal through the puck.
        let distance = (self.opponent_goal - puck.x).hypot(puck.y);
        let back = self.contact_distance + RUN_UP;
        let start = mallet.nearest_allowed(
            puck.x - back * (self.opponent_goal - puck.x) / distance,
            puck.y + back * puck.y / distance,
        );
        let remaining = (start[0] - mallet.x).hypot(start[1] - mallet.y);
        // Shoot once the mallet is there (m) and almost at rest (m/s).
        if remaining < 0.012 && mallet.vx.hypot(mallet.vy) < 0.1 {
            let (to_x, to_y) = (puck.x - start[0], puck.y - start[1]);
            let length = to_x.hypot(to_y);
            return Ok(self.shoot(Shot {
                dx: to_x / length,
                dy: to_y / length,
                steps_left: MAX_SHOT_STEPS,
            }));
        }
        let waypoint = self.waypoint(start);
        Ok(self.mallet.move_to(waypoint, 1.0))
    }
}

//! Strikes the puck at the other goal: gets behind it, accelerates along a line, brakes. Change anything.
//!
//! Positions are in the robot's own base frame: x grows towards the other goal; metres, radians, seconds.

use crate::{mallet::Mallet, puck::Puck};
use faceoff_agent::{Action, Agent, Env, Failure, Observation};

/// Speed of the mallet in a strike, m/s.
const STRIKE: f64 = 1.6;
/// And the way on which it gets there, m.
const RUN_UP: f64 = 0.16;
/// A faster puck is waited for, m/s.
const SLOW: f64 = 0.35;

/// A strike: its direction, and the control steps that are left.
struct Line {
    dx: f64,
    dy: f64,
    left: u32,
}

pub struct Policy {
    mallet: Mallet,
    puck: Puck,
    contact: f64,
    /// x of the table's centre, m.
    middle: f64,
    /// x of the other goal's line, m.
    other_goal: f64,
    started: bool,
    line: Option<Line>,
}

impl Policy {
    pub fn new(env: &Env) -> Self {
        let middle = env.robot.base_distance_m().unwrap_or(1.51);
        Self {
            middle,
            other_goal: middle + env.table.length / 2.0,
            mallet: Mallet::new(env),
            puck: Puck::new(env),
            contact: env.puck.radius + env.mallet.radius,
            started: false,
            line: None,
        }
    }

    fn strike(&mut self, Line { dx, dy, left }: Line) -> Action {
        let (mallet, puck) = (&mut self.mallet, self.puck.now);
        let ahead = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy;
        if left == 0 || ahead < 0.0 {
            return mallet.r#move(0.0, 0.0);
        }
        // Once it touches the puck, a moment more is enough.
        let left = if ahead < self.contact + 0.005 {
            left.min(2)
        } else {
            left
        };
        self.line = Some(Line {
            dx,
            dy,
            left: left - 1,
        });
        // Across the line it follows the puck, which may be rolling.
        let across = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy;
        mallet.r#move(
            STRIKE * dx - 6.0 * across * dy,
            STRIKE * dy + 6.0 * across * dx,
        )
    }

    /// The way to a point that does not lead through the puck: the point, or one beside the puck.
    fn around(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (mallet, puck, room) = (&self.mallet, self.puck.now, self.contact + 0.02);
        let way = (x - mallet.x).hypot(y - mallet.y).max(1e-6);
        let (dx, dy) = ((x - mallet.x) / way, (y - mallet.y) / way);
        let along = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy;
        // The puck, seen along the way.
        let left = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy;
        if along < 0.0 || along > way + room || left.abs() > room {
            return [x, y];
        }
        // Pass on the side that is nearer, unless the rim is there.
        let near = if left > 0.0 { -1.0 } else { 1.0 };
        [near, -near]
            .map(|side| {
                [
                    puck.x - side * dy * (room + 0.03),
                    puck.y + side * dx * (room + 0.03),
                ]
            })
            .into_iter()
            .find(|beside| mallet.inside(beside[0], beside[1]) == *beside)
            .unwrap_or([x, y])
    }
}

impl Agent for Policy {
    fn reset(&mut self) {
        self.puck.reset();
        self.started = false;
        self.line = None;
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
        if !self.started {
            self.mallet.reset(observation.joint_positions());
            self.started = true;
        }
        self.puck.observe(observation.puck());
        if let Some(line) = self.line.take() {
            return Ok(self.strike(line));
        }
        let (mallet, puck) = (&mut self.mallet, self.puck.now);
        if puck.speed() > SLOW || puck.x > self.middle - 0.15 {
            return Ok(mallet.go([mallet.goal + 0.14, (0.3 * puck.y).clamp(-0.1, 0.1)], 1.0));
        }
        // From behind the puck towards the middle of the goal, from as near to that line as the mallet gets.
        let way = (self.other_goal - puck.x).hypot(puck.y);
        let back = self.contact + RUN_UP;
        let start = mallet.inside(
            puck.x - back * (self.other_goal - puck.x) / way,
            puck.y + back * puck.y / way,
        );
        let away = (start[0] - mallet.x).hypot(start[1] - mallet.y);
        if away < 0.012 && mallet.vx.hypot(mallet.vy) < 0.1 {
            let (to_x, to_y) = (puck.x - start[0], puck.y - start[1]);
            let length = to_x.hypot(to_y);
            return Ok(self.strike(Line {
                dx: to_x / length,
                dy: to_y / length,
                left: 20,
            }));
        }
        let beside = self.around(start);
        Ok(self.mallet.go(beside, 1.0))
    }
}

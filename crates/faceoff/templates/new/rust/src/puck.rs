//! Where the puck is and where it will be, from observations that are noisy and sometimes missing.

use faceoff_agent::Env;

/// How far one observation moves the estimated velocity.
const TRUST: f64 = 0.35;
/// Share of its speed that the puck loses per second.
const DRAG: f64 = 0.5;
/// Share of its speed across a rim that a bounce leaves.
const BOUNCE: f64 = 0.75;

/// Place (m) and velocity (m/s) in the robot's own base frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    pub x: f64,
    pub y: f64,
    pub vx: f64,
    pub vy: f64,
}

impl Motion {
    pub fn speed(&self) -> f64 {
        self.vx.hypot(self.vy)
    }
}

/// An estimate.
pub struct Puck {
    dt: f64,
    y_max: f64,
    seen: Option<[f64; 2]>,
    pub now: Motion,
}

impl Puck {
    pub fn new(env: &Env) -> Self {
        Self {
            dt: env.dt,
            y_max: env.table.width / 2.0 - env.puck.radius,
            seen: None,
            now: Motion::default(),
        }
    }

    pub fn reset(&mut self) {
        self.seen = None;
    }

    /// Takes in an observation of the puck.
    pub fn observe(&mut self, [x, y, _, vx, vy, _]: [f64; 6]) {
        let expected = self.after(self.dt);
        self.now = if self.seen.is_none() {
            Motion { x, y, vx, vy }
        } else if self.seen == Some([x, y]) && vx == 0.0 && vy == 0.0 {
            // Not seen: the old place came again. It will have slid on.
            expected
        } else {
            // Two witnesses for the velocity: what is reported, and the way since the last step.
            let new_vx = 0.5 * (vx + (x - self.now.x) / self.dt);
            let new_vy = 0.5 * (vy + (y - self.now.y) / self.dt);
            let was_hit = (new_vx - expected.vx).abs() + (new_vy - expected.vy).abs() > 0.7;
            let trust = if was_hit { 1.0 } else { TRUST };
            let vx = expected.vx + trust * (new_vx - expected.vx);
            let vy = expected.vy + trust * (new_vy - expected.vy);
            Motion { x, y, vx, vy }
        };
        self.seen = Some([x, y]);
    }

    /// The motion after some time (s, at most 1.5); bounces off the long rims count, all else does not.
    pub fn after(&self, time: f64) -> Motion {
        let time = time.min(1.5);
        let (slide, fade) = (time * (1.0 - 0.5 * DRAG * time), 1.0 - DRAG * time);
        let Motion { x, y, vx, vy } = self.now;
        let mut then = Motion {
            x: x + vx * slide,
            y: y + vy * slide,
            vx: vx * fade,
            vy: vy * fade,
        };
        while then.y.abs() > self.y_max {
            let rim = self.y_max.copysign(then.y);
            then.y = rim - BOUNCE * (then.y - rim);
            then.vy *= -BOUNCE;
        }
        then
    }
}

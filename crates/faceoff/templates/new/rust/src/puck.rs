//! Estimates the puck's state from noisy and sometimes missing observations, and predicts its motion.

use faceoff_agent::Env;

/// Weight of a new observation in the velocity estimate.
const GAIN: f64 = 0.35;
/// Fraction of its speed that the puck loses per second.
const DRAG: f64 = 0.5;
/// Fraction of the speed across the rim that remains after a bounce.
const RESTITUTION: f64 = 0.75;
/// A larger change of the velocity is a hit or a bounce, not noise, m/s.
const HIT_CHANGE: f64 = 0.7;

/// Position (m) and velocity (m/s) in the robot's base frame.
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

/// The estimated puck.
pub struct Puck {
    /// Length of a control step, s.
    dt: f64,
    /// y of a puck that touches the rim, m.
    y_max: f64,
    last_observed: Option<[f64; 2]>,
    pub state: Motion,
}

impl Puck {
    pub fn new(env: &Env) -> Self {
        Self {
            dt: env.dt,
            y_max: env.table.width / 2.0 - env.puck.radius,
            last_observed: None,
            state: Motion::default(),
        }
    }

    pub fn reset(&mut self) {
        self.last_observed = None;
    }

    /// Updates the estimate with an observation.
    pub fn observe(&mut self, [x, y, _yaw, vx, vy, _yaw_rate]: [f64; 6]) {
        let expected = self.predict(self.dt);
        self.state = if self.last_observed.is_none() {
            Motion { x, y, vx, vy }
        } else if self.last_observed == Some([x, y]) && vx == 0.0 && vy == 0.0 {
            // The puck was not seen and the old position is repeated: use its predicted motion instead.
            expected
        } else {
            // There are two measurements of the velocity: the observed one, and the distance since the last step.
            let new_vx = 0.5 * (vx + (x - self.state.x) / self.dt);
            let new_vy = 0.5 * (vy + (y - self.state.y) / self.dt);
            let change = (new_vx - expected.vx).abs() + (new_vy - expected.vy).abs();
            let was_hit = change > HIT_CHANGE;
            let gain = if was_hit { 1.0 } else { GAIN };
            let vx = expected.vx + gain * (new_vx - expected.vx);
            let vy = expected.vy + gain * (new_vy - expected.vy);
            Motion { x, y, vx, vy }
        };
        self.last_observed = Some([x, y]);
    }

    /// The motion after some time (s, at most 1.5), with bounces off the long rims but no other contacts.
    pub fn predict(&self, time: f64) -> Motion {
        let time = time.min(1.5);
        let distance_factor = time * (1.0 - 0.5 * DRAG * time);
        let speed_factor = 1.0 - DRAG * time;
        let Motion { x, y, vx, vy } = self.state;
        let mut predicted = Motion {
            x: x + vx * distance_factor,
            y: y + vy * distance_factor,
            vx: vx * speed_factor,
            vy: vy * speed_factor,
        };
        while predicted.y.abs() > self.y_max {
            let rim = self.y_max.copysign(predicted.y);
            predicted.y = rim - RESTITUTION * (predicted.y - rim);
            predicted.vy *= -RESTITUTION;
        }
        predicted
    }
}

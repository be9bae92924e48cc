//! Smooth mallet motions in the plane: polynomials of degree five (*quintics*) in time, replanned at every control step. The planned
//! position, velocity and acceleration of the mallet are its *reference*.

use crate::field::{Field, Vec2};

/// Deceleration in front of the bounds of the mallet's area, m/s².
const BOUND_BRAKE: f64 = 12.0;

/// State of the mallet reference in the field frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Position, metres.
    pub pos: Vec2,
    /// Velocity, m/s.
    pub vel: Vec2,
    /// Acceleration, m/s².
    pub acc: Vec2,
}

/// Target of a mallet motion: position, velocity and time of arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Position, metres.
    pub pos: Vec2,
    /// Velocity on arrival, m/s.
    pub vel: Vec2,
    /// Time from now to arrival, seconds.
    pub time: f64,
}

impl Target {
    /// A target to stop at, reached within the limits of `pace`.
    pub fn stop(from: &Motion, pos: Vec2, pace: Pace) -> Self {
        let braking_time = from.vel.norm() / pace.acceleration;
        let distance = (pos - from.pos).norm();
        // A quintic from rest to rest peaks at 1.875 times its mean speed and 5.77 d/T².
        let time =
            (1.875 * distance / pace.speed).max((5.77 * distance / pace.acceleration).sqrt());
        Self {
            pos,
            vel: Vec2::zeros(),
            time: time.max(1.5 * braking_time).max(0.06),
        }
    }
}

/// Limits of a motion to a point at which the mallet stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Peak speed, m/s.
    pub speed: f64,
    /// Peak acceleration, m/s².
    pub acceleration: f64,
}

impl Pace {
    /// Slow positioning.
    pub const CALM: Self = Self {
        speed: 0.7,
        acceleration: 3.0,
    };
    /// Fast positioning.
    pub const QUICK: Self = Self {
        speed: 1.3,
        acceleration: 8.0,
    };
}

impl Motion {
    pub fn at_rest(pos: Vec2) -> Self {
        Self {
            pos,
            vel: Vec2::zeros(),
            acc: Vec2::zeros(),
        }
    }

    /// The state after `time` seconds on the quintic to the target, where the mallet arrives without acceleration.
    pub fn towards(&self, target: &Target, time: f64) -> Self {
        let total_time = target.time.max(time).max(1e-3);
        // The quintic in the share u of the total time, with coefficients c3 to c5.
        let u = time / total_time;
        let (p0, v0, a0) = (
            self.pos,
            self.vel * total_time,
            self.acc * total_time * total_time,
        );
        let (p1, v1) = (target.pos, target.vel * total_time);
        let d = p1 - p0 - v0 - 0.5 * a0;
        let dv = v1 - v0 - a0;
        let da = -a0;
        let c3 = 10.0 * d - 4.0 * dv + 0.5 * da;
        let c4 = -15.0 * d + 7.0 * dv - da;
        let c5 = 6.0 * d - 3.0 * dv + 0.5 * da;
        let pos = p0 + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))));
        let vel = v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)));
        let acc = a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5));
        Self {
            pos,
            vel: vel / total_time,
            acc: acc / (total_time * total_time),
        }
    }

    /// Peak speed and acceleration on the way to `target`, and how far the path leaves the allowed area.
    pub fn effort(&self, target: &Target, field: &Field) -> Effort {
        let mut effort = Effort {
            speed: 0.0,
            acceleration: 0.0,
            excess: 0.0,
        };
        for k in 1..=8 {
            let state = self.towards(target, target.time * f64::from(k) / 8.0);
            effort.speed = effort.speed.max(state.vel.norm());
            effort.acceleration = effort.acceleration.max(state.acc.norm());
            effort.excess = effort
                .excess
                .max((state.pos - field.clamp_mallet(state.pos)).norm());
        }
        effort
    }

    /// Limits the change of velocity since the state `before`, `dt` seconds ago: a late change of plan may require
    /// more than the arm can follow. `acceleration` is the limit, m/s².
    pub fn limit(&mut self, before: &Self, dt: f64, acceleration: f64) {
        let change = self.vel - before.vel;
        let change_max = acceleration * dt;
        if change.norm() > change_max {
            let change = change * (change_max / change.norm());
            self.vel = before.vel + change;
            self.pos = before.pos + 0.5 * dt * (before.vel + self.vel);
            self.acc = change / dt;
        }
    }

    /// Keeps the reference in the allowed area: the mallet approaches a bound only as fast as it can still stop
    /// before it.
    pub fn confine(&mut self, before: &Self, dt: f64, field: &Field) {
        let (low, high) = field.mallet_bounds();
        for i in 0..2 {
            let distance_left = if self.vel[i] > 0.0 {
                high[i] - before.pos[i]
            } else {
                before.pos[i] - low[i]
            };
            let speed_max = (2.0 * BOUND_BRAKE * distance_left.max(0.0)).sqrt();
            if self.vel[i].abs() > speed_max {
                self.vel[i] = speed_max * self.vel[i].signum();
                self.pos[i] = before.pos[i] + dt * self.vel[i];
                self.acc[i] = 0.0;
            }
            self.pos[i] = self.pos[i].clamp(low[i], high[i]);
        }
        // The same for the bound of the arm's reach, a circle around its base.
        let radius = field.to_base(self.pos);
        let outward = radius / radius.norm();
        let distance_left = field.reach_max() - field.to_base(before.pos).norm();
        let speed_max = (2.0 * BOUND_BRAKE * distance_left.max(0.0)).sqrt();
        let excess = self.vel.dot(&outward) - speed_max;
        if excess > 0.0 {
            self.vel -= excess * outward;
            self.pos = before.pos + dt * self.vel;
            self.acc = Vec2::zeros();
        }
        self.pos = field.clamp_mallet(self.pos);
    }
}

/// Demands of a motion on the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Peak speed, m/s.
    pub speed: f64,
    /// Peak acceleration, m/s².
    pub acceleration: f64,
    /// Largest distance of the path from the allowed area, metres.
    pub excess: f64,
}

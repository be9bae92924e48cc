//! Smooth mallet motions in the plane: quintic polynomials, replanned at every control step.

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
        let brake = from.vel.norm() / pace.acceleration;
        let distance = (pos - from.pos).norm();
        // A quintic from rest to rest peaks at 1.875 times its mean speed and 5.77 d/T².
        let time =
            (1.875 * distance / pace.speed).max((5.77 * distance / pace.acceleration).sqrt());
        Self {
            pos,
            vel: Vec2::zeros(),
            time: time.max(1.5 * brake).max(0.06),
        }
    }
}

/// Limits of a positioning motion.
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
    pub fn rest(pos: Vec2) -> Self {
        Self {
            pos,
            vel: Vec2::zeros(),
            acc: Vec2::zeros(),
        }
    }

    /// The state `t` seconds along the quintic to the target (arriving without acceleration).
    pub fn towards(&self, target: &Target, t: f64) -> Self {
        let total = target.time.max(t).max(1e-3);
        let u = t / total;
        let (p0, v0, a0) = (self.pos, self.vel * total, self.acc * total * total);
        let (p1, v1) = (target.pos, target.vel * total);
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
            vel: vel / total,
            acc: acc / (total * total),
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
            let m = self.towards(target, target.time * f64::from(k) / 8.0);
            effort.speed = effort.speed.max(m.vel.norm());
            effort.acceleration = effort.acceleration.max(m.acc.norm());
            effort.excess = effort
                .excess
                .max((m.pos - field.clamp_mallet(m.pos)).norm());
        }
        effort
    }

    /// Limits the change of velocity since `before`, `dt` seconds ago: a late change of plan may require
    /// more than the arm can follow.
    pub fn limit(&mut self, before: &Self, dt: f64, acceleration: f64) {
        let change = self.vel - before.vel;
        let max = acceleration * dt;
        if change.norm() > max {
            let change = change * (max / change.norm());
            self.vel = before.vel + change;
            self.pos = before.pos + 0.5 * dt * (before.vel + self.vel);
            self.acc = change / dt;
        }
    }

    /// Keeps the reference in the allowed area: it approaches a bound only as fast as it can still stop
    /// before it.
    pub fn confine(&mut self, before: &Self, dt: f64, field: &Field) {
        let (low, high) = field.mallet_bounds();
        for i in 0..2 {
            let room = if self.vel[i] > 0.0 {
                high[i] - before.pos[i]
            } else {
                before.pos[i] - low[i]
            };
            let max = (2.0 * BOUND_BRAKE * room.max(0.0)).sqrt();
            if self.vel[i].abs() > max {
                self.vel[i] = max * self.vel[i].signum();
                self.pos[i] = before.pos[i] + dt * self.vel[i];
                self.acc[i] = 0.0;
            }
            self.pos[i] = self.pos[i].clamp(low[i], high[i]);
        }
        // The same along the reach of the arm.
        let radius = field.to_base(self.pos);
        let outward = radius / radius.norm();
        let room = field.reach_max() - field.to_base(before.pos).norm();
        let max = (2.0 * BOUND_BRAKE * room.max(0.0)).sqrt();
        let excess = self.vel.dot(&outward) - max;
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

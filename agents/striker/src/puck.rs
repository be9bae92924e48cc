//! Motion of the puck: sliding with viscous drag, bouncing off rims, struck by a mallet.
//!
//! A coarse, closed-form counterpart of the simulator's contact law, accurate enough to plan one or
//! two seconds ahead at negligible cost. The numbers are means over the real, softer contacts.

use crate::field::{Field, Vec2};

/// Velocity decay of the sliding puck, 1/s.
pub const DRAG: f64 = 0.5;
/// Mean coefficient of restitution of the rims.
pub const RIM_RESTITUTION: f64 = 0.75;
/// Share of the slip between puck and rim that one bounce removes (one or two substeps' contact).
const RIM_GRIP: f64 = 0.37;
/// Mean coefficient of restitution of the mallet.
pub const MALLET_RESTITUTION: f64 = 0.44;
/// Share of the slip that a mallet contact removes.
const MALLET_GRIP: f64 = 0.8;
/// Decay of the yaw rate, 1/s.
const SPIN_DRAG: f64 = 0.4;
/// Share of a removed slip that changes the puck's velocity: 1/(1 + m r²/I); the rest changes its spin.
const SLIP_TO_VELOCITY: f64 = 1.0 / (1.0 + 0.01 * 0.031_65 * 0.031_65 / 5e-6);

/// State of the puck in the field frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Puck {
    /// Position, metres.
    pub pos: Vec2,
    /// Velocity, m/s.
    pub vel: Vec2,
    /// Yaw rate, rad/s.
    pub spin: f64,
}

/// The boundary that a puck reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// A short side: the normal is along x.
    Short,
    /// A long side: the normal is along y.
    Long,
    /// A goal mouth, where the puck leaves the table.
    Goal,
}

impl Puck {
    /// Slides for `time` seconds without rims.
    fn slide(&mut self, time: f64) {
        let decay = (-DRAG * time).exp();
        self.pos += self.vel * ((1.0 - decay) / DRAG);
        self.vel *= decay;
        self.spin *= (-SPIN_DRAG * time).exp();
    }

    /// Time until the next rim and that rim; `None` if the puck stops before.
    pub fn next_rim(&self, field: &Field) -> Option<(f64, Rim)> {
        let arrival = |pos: f64, vel: f64, bound: f64| {
            let distance = if vel > 0.0 { bound - pos } else { bound + pos };
            let share = DRAG * distance.max(0.0) / vel.abs();
            (vel.abs() > 1e-6 && share < 1.0).then(|| -(1.0 - share).ln() / DRAG)
        };
        let short = arrival(self.pos.x, self.vel.x, field.puck_x());
        let long = arrival(self.pos.y, self.vel.y, field.puck_y());
        match (short, long) {
            (Some(s), Some(l)) if l < s => Some((l, Rim::Long)),
            (Some(s), _) => {
                let y = self.pos.y + self.vel.y * (1.0 - (-DRAG * s).exp()) / DRAG;
                // A puck that just grazes the rounded post still enters the goal.
                let rim = if y.abs() < field.half_goal - 0.7 * field.puck {
                    Rim::Goal
                } else {
                    Rim::Short
                };
                Some((s, rim))
            }
            (None, Some(l)) => Some((l, Rim::Long)),
            (None, None) => None,
        }
    }

    /// Slides for `time` seconds, bouncing off the rims. Returns false if it left through a goal.
    pub fn advance(&mut self, field: &Field, time: f64) -> bool {
        let mut left = time;
        // A puck in a corner bounces at most a few times in any span that is planned.
        for _ in 0..12 {
            match self.next_rim(field) {
                Some((t, rim)) if t <= left => {
                    self.slide(t);
                    left -= t;
                    if rim == Rim::Goal {
                        return false;
                    }
                    self.bounce(rim);
                }
                _ => break,
            }
        }
        self.slide(left);
        true
    }

    /// Applies the contact with a rim.
    pub fn bounce(&mut self, rim: Rim) {
        let normal = match rim {
            Rim::Short => Vec2::new(-self.vel.x.signum(), 0.0),
            Rim::Long => Vec2::new(0.0, -self.vel.y.signum()),
            Rim::Goal => return,
        };
        self.collide(normal, Vec2::zeros(), RIM_RESTITUTION, RIM_GRIP);
    }

    /// Applies a strike by a mallet at `mallet` moving with `velocity`; nothing changes if they already
    /// separate.
    pub fn strike(&mut self, mallet: Vec2, velocity: Vec2) {
        let offset = self.pos - mallet;
        let distance = offset.norm();
        if distance > 1e-9 {
            self.collide(offset / distance, velocity, MALLET_RESTITUTION, MALLET_GRIP);
        }
    }

    /// Applies the impulse along `normal` (into the puck) and the friction of a body moving with `other`.
    fn collide(&mut self, normal: Vec2, other: Vec2, restitution: f64, grip: f64) {
        let relative = self.vel - other;
        let approach = relative.dot(&normal);
        if approach >= 0.0 {
            return;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let radius = 0.031_65;
        let slip = relative.dot(&tangent) - self.spin * radius;
        // Friction is bounded by the normal impulse (coefficient one for the mallet; the rims grip
        // so briefly that the bound never matters).
        let push = (1.0 + restitution) * -approach;
        let along = (grip * slip * SLIP_TO_VELOCITY).clamp(-push, push);
        self.vel += normal * push - tangent * along;
        self.spin += along * (1.0 - SLIP_TO_VELOCITY) / SLIP_TO_VELOCITY / radius;
    }
}

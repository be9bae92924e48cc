//! Motion of the puck: sliding with viscous drag, bouncing off rims, struck by a mallet.
//!
//! A coarse, closed-form counterpart of the simulator's contact law, accurate enough to plan one or
//! two seconds ahead at negligible cost. The numbers are means over the real, softer contacts.

use crate::field::{Field, Vec2};

/// Rate at which the sliding puck's velocity decays, 1/s.
pub const DRAG: f64 = 0.5;
/// Mean coefficient of restitution of the rims.
pub const RIM_RESTITUTION: f64 = 0.75;
/// Share of the slip (relative speed along the surface) between puck and rim that one bounce removes. The contact lasts one or two of the
/// simulator's steps of 1 ms.
const RIM_SLIP_REMOVED: f64 = 0.37;
/// Mean coefficient of restitution of the mallet.
pub const MALLET_RESTITUTION: f64 = 0.44;
/// Share of the slip that a mallet contact removes.
const MALLET_SLIP_REMOVED: f64 = 0.8;
/// Rate at which the yaw rate decays, 1/s.
const SPIN_DRAG: f64 = 0.4;
/// Radius of the puck, metres.
const RADIUS: f64 = 0.031_65;
/// Share of a removed slip that changes the puck's velocity: 1/(1 + m r²/I) with mass m, radius r and yaw inertia I; the rest changes its
/// spin.
const SLIP_TO_VELOCITY: f64 = 1.0 / (1.0 + 0.01 * RADIUS * RADIUS / 5e-6);

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

/// The boundary of the table that a puck reaches.
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

    /// Time, seconds, until the puck reaches the next rim, and that rim; `None` if the puck stops before.
    pub fn next_rim(&self, field: &Field) -> Option<(f64, Rim)> {
        let arrival_time = |pos: f64, vel: f64, bound: f64| {
            let distance = if vel > 0.0 { bound - pos } else { bound + pos };
            let speed_loss = DRAG * distance.max(0.0) / vel.abs();
            (vel.abs() > 1e-6 && speed_loss < 1.0).then(|| -(1.0 - speed_loss).ln() / DRAG)
        };
        let short = arrival_time(self.pos.x, self.vel.x, field.puck_x_max());
        let long = arrival_time(self.pos.y, self.vel.y, field.puck_y_max());
        match (short, long) {
            (Some(short), Some(long)) if long < short => Some((long, Rim::Long)),
            (Some(short), _) => {
                let y = self.pos.y + self.vel.y * (1.0 - (-DRAG * short).exp()) / DRAG;
                // A puck that just grazes the rounded post still enters the goal.
                let rim = if y.abs() < field.half_goal - 0.7 * field.puck_radius {
                    Rim::Goal
                } else {
                    Rim::Short
                };
                Some((short, rim))
            }
            (None, Some(long)) => Some((long, Rim::Long)),
            (None, None) => None,
        }
    }

    /// Slides for `time` seconds, bouncing off the rims. Returns false if the puck went into a goal.
    pub fn advance(&mut self, field: &Field, time: f64) -> bool {
        let mut time_left = time;
        // A puck in a corner bounces at most a few times in any span that is planned.
        for _ in 0..12 {
            match self.next_rim(field) {
                Some((time, rim)) if time <= time_left => {
                    self.slide(time);
                    time_left -= time;
                    if rim == Rim::Goal {
                        return false;
                    }
                    self.bounce(rim);
                }
                _ => break,
            }
        }
        self.slide(time_left);
        true
    }

    /// Applies the contact with a rim.
    pub fn bounce(&mut self, rim: Rim) {
        let normal = match rim {
            Rim::Short => Vec2::new(-self.vel.x.signum(), 0.0),
            Rim::Long => Vec2::new(0.0, -self.vel.y.signum()),
            Rim::Goal => return,
        };
        self.collide(normal, Vec2::zeros(), RIM_RESTITUTION, RIM_SLIP_REMOVED);
    }

    /// Applies a strike by a mallet at `mallet` moving with `velocity`; nothing changes if they already
    /// separate.
    pub fn strike(&mut self, mallet: Vec2, velocity: Vec2) {
        let offset = self.pos - mallet;
        let distance = offset.norm();
        if distance > 1e-9 {
            self.collide(
                offset / distance,
                velocity,
                MALLET_RESTITUTION,
                MALLET_SLIP_REMOVED,
            );
        }
    }

    /// Applies the impulse along `normal` (into the puck) and the friction of a body that moves with `other_velocity`. `slip_removed`
    /// is the share of the slip that the contact removes.
    fn collide(&mut self, normal: Vec2, other_velocity: Vec2, restitution: f64, slip_removed: f64) {
        let relative = self.vel - other_velocity;
        let normal_speed = relative.dot(&normal);
        if normal_speed >= 0.0 {
            return;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let radius = RADIUS;
        let slip = relative.dot(&tangent) - self.spin * radius;
        // Friction is bounded by the normal impulse: its coefficient is 1 for the mallet, and contacts with rims are
        // so short that the bound never matters.
        let normal_change = (1.0 + restitution) * -normal_speed;
        let tangent_change =
            (slip_removed * slip * SLIP_TO_VELOCITY).clamp(-normal_change, normal_change);
        self.vel += normal * normal_change - tangent * tangent_change;
        self.spin += tangent_change * (1.0 - SLIP_TO_VELOCITY) / SLIP_TO_VELOCITY / radius;
    }
}

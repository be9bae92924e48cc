//! What every skill sees, and what it may order.

use crate::arm::{Arm, Posture, Side};
use crate::field::{Field, Vec2};
use crate::keeper::Keeper;
use crate::motion::{Motion, Pace, Target};
use crate::puck::Puck;

/// What a skill sees at a control step. All in the field frame.
#[derive(Debug)]
pub struct Scene<'a> {
    pub field: &'a Field,
    /// Control period, seconds.
    pub dt: f64,
    /// Seconds since the episode's (or rally's) start.
    pub time: f64,
    pub puck: Puck,
    /// Standard deviation of its velocity components, m/s.
    pub puck_speed_deviation: Vec2,
    pub mallet: Motion,
    /// The arm, for what it can do.
    pub arm: &'a Arm,
    /// Who may be in a shot's way.
    pub keeper: &'a Keeper,
}

/// What a skill wants the mallet to do next.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// Where to, how fast on arrival, in what time.
    pub target: Target,
    /// Preference for the free degrees of freedom.
    pub posture: Posture,
    /// Largest acceleration of the reference, m/s².
    pub acceleration: f64,
}

/// Largest acceleration of references outside strikes, m/s².
const ACCELERATION: f64 = 14.0;

impl Order {
    /// An order with the usual bound on the acceleration.
    pub fn new(target: Target, posture: Posture) -> Self {
        Self {
            target,
            posture,
            acceleration: ACCELERATION,
        }
    }

    /// Go to a point and stop there.
    pub fn stop(scene: &Scene<'_>, pos: Vec2, pace: Pace) -> Self {
        let pos = scene.field.clamp_mallet(pos);
        Self::new(
            Target::stop(&scene.mallet, pos, pace),
            Posture::Ready(lean(pos)),
        )
    }

    /// Slow down along the present direction.
    pub fn brake(scene: &Scene<'_>) -> Self {
        let time = 0.1 + 0.1 * scene.mallet.vel.norm();
        let pos = scene
            .field
            .clamp_mallet(scene.mallet.pos + 0.5 * time * scene.mallet.vel);
        Self::new(
            Target {
                pos,
                vel: Vec2::zeros(),
                time,
            },
            Posture::Ready(lean(pos)),
        )
    }

    /// Keep the present velocity.
    pub fn coast(scene: &Scene<'_>, velocity: Vec2, posture: Posture) -> Self {
        let time = 0.1;
        Self::new(
            Target {
                pos: scene.mallet.pos + time * velocity,
                vel: velocity,
                time,
            },
            posture,
        )
    }
}

/// The side to lean to for strikes from `pos` towards the middle of the other goal.
pub fn lean(pos: Vec2) -> Side {
    if pos.y >= 0.0 {
        Side::Right
    } else {
        Side::Left
    }
}

/// A way to `goal` that keeps the mallet's centre `clearance` away from the puck: `goal` itself, or
/// a point beside the puck first.
pub fn around(scene: &Scene<'_>, goal: Vec2, clearance: f64) -> Vec2 {
    let from = scene.mallet.pos;
    let puck = scene.puck.pos + 0.1 * scene.puck.vel;
    // A goal closer to the puck than that is approached as closely as it lies itself.
    let clearance = clearance.min((goal - puck).norm() - 1e-3);
    let way = goal - from;
    let length = way.norm();
    if length < 1e-6 {
        return goal;
    }
    let direction = way / length;
    let along = (puck - from).dot(&direction);
    let nearest = from + direction * along.clamp(0.0, length);
    let away = nearest - puck;
    let distance = away.norm();
    if distance >= clearance || along <= 0.0 {
        return goal;
    }
    // Pass on the side where the straight way already lies, unless the rim is there.
    let normal = Vec2::new(-direction.y, direction.x);
    let mut side = if away.dot(&normal) >= 0.0 {
        normal
    } else {
        -normal
    };
    let mut waypoint = puck + side * (clearance + 0.02);
    if (waypoint - scene.field.clamp_mallet(waypoint)).norm() > 0.03 {
        side = -side;
        waypoint = puck + side * (clearance + 0.02);
    }
    scene.field.clamp_mallet(waypoint)
}

//! Input and output of the skills (decisions how to play): the *scene*, the estimated state of the table, and the command for the mallet.

use crate::arm::{Arm, Posture, Side};
use crate::field::{Field, Vec2};
use crate::keeper::Keeper;
use crate::motion::{Motion, Pace, Target};
use crate::puck::Puck;

/// Estimated state at a control step, in the field frame.
#[derive(Debug)]
pub struct Scene<'a> {
    pub field: &'a Field,
    /// Control period, seconds.
    pub dt: f64,
    /// Seconds since the episode's (or rally's) start.
    pub time: f64,
    pub puck: Puck,
    /// Standard deviations of the puck's velocity components, m/s.
    pub puck_velocity_deviation: Vec2,
    /// Reference of the own mallet: its commanded motion.
    pub mallet: Motion,
    /// The arm, for its possible speeds.
    pub arm: &'a Arm,
    /// The opponent's mallet, an obstacle for shots.
    pub keeper: &'a Keeper,
}

/// A skill's command for the mallet.
#[derive(Debug, Clone, Copy)]
pub struct MalletCommand {
    /// Position, velocity and time of arrival.
    pub target: Target,
    /// Preference for the arm's free degrees of freedom.
    pub posture: Posture,
    /// Largest acceleration of the mallet's reference, m/s².
    pub acceleration: f64,
}

/// Largest acceleration of references outside strikes, m/s².
const ACCELERATION: f64 = 14.0;

impl MalletCommand {
    /// A command with the default limit of the acceleration.
    pub fn new(target: Target, posture: Posture) -> Self {
        Self {
            target,
            posture,
            acceleration: ACCELERATION,
        }
    }

    /// Moves to a point and stops there.
    pub fn stop(scene: &Scene<'_>, pos: Vec2, pace: Pace) -> Self {
        let pos = scene.field.clamp_mallet(pos);
        Self::new(
            Target::stop(&scene.mallet, pos, pace),
            Posture::Ready(elbow_side(pos)),
        )
    }

    /// Stops soon, along the present direction.
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
            Posture::Ready(elbow_side(pos)),
        )
    }

    /// Continues with `velocity`.
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

/// The elbow's side for strikes from `pos` towards the centre of the opponent's goal.
pub fn elbow_side(pos: Vec2) -> Side {
    if pos.y >= 0.0 {
        Side::Right
    } else {
        Side::Left
    }
}

/// The next point of a path to `destination` that keeps the mallet's centre `clearance` away from the puck:
/// `destination` itself, or a point beside the puck.
pub fn waypoint(scene: &Scene<'_>, destination: Vec2, clearance: f64) -> Vec2 {
    let from = scene.mallet.pos;
    // The puck's position in a tenth of a second.
    let puck = scene.puck.pos + 0.1 * scene.puck.vel;
    // If the destination is closer to the puck than the clearance, its distance is the clearance.
    let clearance = clearance.min((destination - puck).norm() - 1e-3);
    let path = destination - from;
    let length = path.norm();
    if length < 1e-6 {
        return destination;
    }
    let direction = path / length;
    let along = (puck - from).dot(&direction);
    let nearest = from + direction * along.clamp(0.0, length);
    let puck_to_path = nearest - puck;
    let distance = puck_to_path.norm();
    if distance >= clearance || along <= 0.0 {
        return destination;
    }
    // Pass the puck on the side of the straight path, unless the rim is there.
    let normal = Vec2::new(-direction.y, direction.x);
    let mut side = if puck_to_path.dot(&normal) >= 0.0 {
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

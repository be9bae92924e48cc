//! The puck at the millisecond scale: the soft contacts of rims and mallet, resolved in substeps.
//!
//! `puck.rs` models a contact as an impulse, which is wrong where two contacts overlap: a mallet that
//! presses a puck against the rim. This model simulates strikes at such pucks.

use crate::field::{Field, Vec2};
use crate::puck::Puck;

/// Length of a substep, seconds.
pub const SUBSTEP: f64 = 1e-3;
/// Mass of the puck, kg.
const MASS: f64 = 0.01;
/// Its yaw inertia, kg m².
const INERTIA: f64 = 5e-6;
/// Viscous damping of sliding, N s/m.
const DAMPING: f64 = 0.005;
/// Viscous damping of yaw, N m s.
const SPIN_DAMPING: f64 = 2e-6;
/// Radius of the rounded goal posts, metres.
const POST: f64 = 0.005;

/// Parameters of a soft contact: impedance at the surface and at depth, damping, stiffness,
/// softness, friction.
struct ContactLaw {
    surface: f64,
    depth: f64,
    damping: f64,
    stiffness: f64,
    softness: f64,
    friction: f64,
    /// Inverse mass of the other body, 1/kg.
    inverse_mass: f64,
}

const RIM: ContactLaw = ContactLaw {
    surface: 0.99,
    depth: 0.999,
    damping: 2.0 / (0.999 * 0.0075),
    stiffness: 1.0 / (0.999 * 0.999 * 0.0075 * 0.0075 * 0.1 * 0.1),
    softness: 200.0 / 3.0,
    friction: 1e4,
    inverse_mass: 0.0,
};
const MALLET: ContactLaw = ContactLaw {
    surface: 0.9,
    depth: 0.95,
    damping: 2.0 / (0.95 * 0.02),
    stiffness: 1.0 / (0.95 * 0.95 * 0.02 * 0.02 * 0.3 * 0.3),
    softness: 200.0 / 3.0 + 1.07,
    friction: 1.0,
    inverse_mass: 1.0,
};

/// Force and torque that accumulate over the contacts of a substep.
struct Wrench {
    force: Vec2,
    torque: f64,
}

/// Advances the puck by one substep, with the mallet at `mallet` moving with `velocity`.
pub fn substep(puck: &mut Puck, field: &Field, mallet: Vec2, velocity: Vec2) {
    let free = Wrench {
        force: -DAMPING * puck.vel,
        torque: -SPIN_DAMPING * puck.spin,
    };
    let mut sum = Wrench {
        force: free.force,
        torque: free.torque,
    };
    let offset = puck.pos - mallet;
    let distance = offset.norm();
    if distance < field.contact() && distance > 1e-9 {
        add_contact(
            puck,
            field,
            &MALLET,
            &free,
            field.contact() - distance,
            offset / distance,
            velocity,
            &mut sum,
        );
    }
    let side = puck.pos.y.abs() - field.puck_y();
    if side > 0.0 {
        add_contact(
            puck,
            field,
            &RIM,
            &free,
            side,
            Vec2::new(0.0, -puck.pos.y.signum()),
            Vec2::zeros(),
            &mut sum,
        );
    }
    let end = puck.pos.x.abs() - field.puck_x();
    if end > 0.0 {
        if puck.pos.y.abs() > field.half_goal + POST {
            add_contact(
                puck,
                field,
                &RIM,
                &free,
                end,
                Vec2::new(-puck.pos.x.signum(), 0.0),
                Vec2::zeros(),
                &mut sum,
            );
        } else {
            let post = Vec2::new(
                (field.half_length + POST) * puck.pos.x.signum(),
                (field.half_goal + POST) * puck.pos.y.signum(),
            );
            let offset = puck.pos - post;
            let distance = offset.norm();
            let depth = field.puck + POST - distance;
            if depth > 0.0 && distance > 1e-9 {
                add_contact(
                    puck,
                    field,
                    &RIM,
                    &free,
                    depth,
                    offset / distance,
                    Vec2::zeros(),
                    &mut sum,
                );
            }
        }
    }
    puck.vel += SUBSTEP / MASS * sum.force;
    puck.spin += SUBSTEP / INERTIA * sum.torque;
    puck.pos += SUBSTEP * puck.vel;
}

/// Adds the force of one contact. Overlapping contacts are solved one by one, accurate enough for
/// planning.
#[expect(
    clippy::too_many_arguments,
    reason = "one equation's terms; a struct would be built for this call only"
)]
fn add_contact(
    puck: &Puck,
    field: &Field,
    law: &ContactLaw,
    free: &Wrench,
    depth: f64,
    normal: Vec2,
    velocity: Vec2,
    sum: &mut Wrench,
) {
    let r = field.puck;
    let x = depth / 1e-3;
    let blend = if x <= 0.5 {
        2.0 * x * x
    } else if x < 1.0 {
        1.0 - 2.0 * (1.0 - x) * (1.0 - x)
    } else {
        1.0
    };
    let impedance = law.surface + (law.depth - law.surface) * blend;
    let softness = (1.0 - impedance) / impedance * law.softness;
    let tangent = Vec2::new(-normal.y, normal.x);
    let relative = puck.vel - velocity;
    let slip = relative.dot(&tangent) - puck.spin * r;
    let free_normal = free.force.dot(&normal) / MASS;
    let free_tangent = free.force.dot(&tangent) / MASS - free.torque / INERTIA * r;
    let push = (-law.damping * relative.dot(&normal) + law.stiffness * impedance * depth
        - free_normal)
        / (1.0 / MASS + law.inverse_mass + softness);
    let push = push.max(0.0);
    let grip = (-law.damping * slip - free_tangent)
        / (1.0 / MASS + r * r / INERTIA + law.inverse_mass + softness);
    let grip = grip.clamp(-law.friction * push, law.friction * push);
    sum.force += push * normal + grip * tangent;
    sum.torque -= grip * r;
}

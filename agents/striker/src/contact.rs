//! The puck's motion in substeps of a millisecond, with the soft contacts of rims and mallet.
//!
//! `puck.rs` models a contact as an impulse, which is wrong where two contacts overlap: a mallet that
//! presses a puck against the rim. This model simulates strikes at such pucks.

use crate::field::{Field, Vec2};
use crate::puck::Puck;

/// Length of a substep, seconds.
pub const SUBSTEP: f64 = 1e-3;
/// Mass of the puck, kg.
const PUCK_MASS: f64 = 0.01;
/// Yaw inertia of the puck, kg m².
const PUCK_INERTIA: f64 = 5e-6;
/// Viscous damping of sliding, N s/m.
const DAMPING: f64 = 0.005;
/// Viscous damping of yaw, N m s.
const SPIN_DAMPING: f64 = 2e-6;
/// Radius of the rounded goal posts, metres.
const POST_RADIUS: f64 = 0.005;

/// Penetration at which a contact's impedance reaches its final value, metres.
const IMPEDANCE_WIDTH: f64 = 1e-3;

/// Parameters of a soft contact, as in the physics engine MuJoCo: a spring and damper whose force grows with the depth of
/// penetration. The *impedance*, between 0 and 1, is the share of the ideal, rigid contact force.
struct ContactLaw {
    impedance_at_surface: f64,
    impedance_at_depth: f64,
    /// 1/s. For MuJoCo's time constant T and final impedance d: 2 / (d T).
    damping: f64,
    /// 1/s². With the damping ratio ζ: 1 / (d² T² ζ²).
    stiffness: f64,
    /// Inverse inertia of the two bodies, 1/kg; MuJoCo scales the softness of the contact by it.
    inverse_inertia: f64,
    /// Coefficient of friction.
    friction: f64,
    /// Inverse mass of the other body, 1/kg.
    inverse_mass: f64,
}

/// Contact of puck and rim: T = 0.0075 s, ζ = 0.1.
const RIM: ContactLaw = ContactLaw {
    impedance_at_surface: 0.99,
    impedance_at_depth: 0.999,
    damping: 2.0 / (0.999 * 0.0075),
    stiffness: 1.0 / (0.999 * 0.999 * 0.0075 * 0.0075 * 0.1 * 0.1),
    inverse_inertia: 200.0 / 3.0,
    friction: 1e4,
    inverse_mass: 0.0,
};
/// Contact of puck and mallet: T = 0.02 s, ζ = 0.3.
const MALLET: ContactLaw = ContactLaw {
    impedance_at_surface: 0.9,
    impedance_at_depth: 0.95,
    damping: 2.0 / (0.95 * 0.02),
    stiffness: 1.0 / (0.95 * 0.95 * 0.02 * 0.02 * 0.3 * 0.3),
    inverse_inertia: 200.0 / 3.0 + 1.07,
    friction: 1.0,
    inverse_mass: 1.0,
};

/// Force (N) and torque (N m) on the puck.
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
    if distance < field.contact_distance() && distance > 1e-9 {
        add_contact(
            puck,
            field,
            &MALLET,
            &free,
            field.contact_distance() - distance,
            offset / distance,
            velocity,
            &mut sum,
        );
    }
    let long_rim_depth = puck.pos.y.abs() - field.puck_y_max();
    if long_rim_depth > 0.0 {
        add_contact(
            puck,
            field,
            &RIM,
            &free,
            long_rim_depth,
            Vec2::new(0.0, -puck.pos.y.signum()),
            Vec2::zeros(),
            &mut sum,
        );
    }
    let short_rim_depth = puck.pos.x.abs() - field.puck_x_max();
    if short_rim_depth > 0.0 {
        if puck.pos.y.abs() > field.half_goal + POST_RADIUS {
            add_contact(
                puck,
                field,
                &RIM,
                &free,
                short_rim_depth,
                Vec2::new(-puck.pos.x.signum(), 0.0),
                Vec2::zeros(),
                &mut sum,
            );
        } else {
            let post = Vec2::new(
                (field.half_length + POST_RADIUS) * puck.pos.x.signum(),
                (field.half_goal + POST_RADIUS) * puck.pos.y.signum(),
            );
            let offset = puck.pos - post;
            let distance = offset.norm();
            let depth = field.puck_radius + POST_RADIUS - distance;
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
    puck.vel += SUBSTEP / PUCK_MASS * sum.force;
    puck.spin += SUBSTEP / PUCK_INERTIA * sum.torque;
    puck.pos += SUBSTEP * puck.vel;
}

/// Adds the force of one contact to `sum`. `free` is the force without contacts, `normal` points into the puck, and `velocity` is that of
/// the other body. Overlapping contacts are solved one after another, which is accurate enough for
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
    let radius = field.puck_radius;
    // The impedance changes smoothly from the surface to the full width.
    let depth_share = depth / IMPEDANCE_WIDTH;
    let blend = if depth_share <= 0.5 {
        2.0 * depth_share * depth_share
    } else if depth_share < 1.0 {
        1.0 - 2.0 * (1.0 - depth_share) * (1.0 - depth_share)
    } else {
        1.0
    };
    let impedance =
        law.impedance_at_surface + (law.impedance_at_depth - law.impedance_at_surface) * blend;
    let regularisation = (1.0 - impedance) / impedance * law.inverse_inertia;
    let tangent = Vec2::new(-normal.y, normal.x);
    let relative = puck.vel - velocity;
    let slip = relative.dot(&tangent) - puck.spin * radius;
    let free_normal = free.force.dot(&normal) / PUCK_MASS;
    let free_tangent = free.force.dot(&tangent) / PUCK_MASS - free.torque / PUCK_INERTIA * radius;
    let normal_force = (-law.damping * relative.dot(&normal) + law.stiffness * impedance * depth
        - free_normal)
        / (1.0 / PUCK_MASS + law.inverse_mass + regularisation);
    let normal_force = normal_force.max(0.0);
    let friction_force = (-law.damping * slip - free_tangent)
        / (1.0 / PUCK_MASS + radius * radius / PUCK_INERTIA + law.inverse_mass + regularisation);
    let friction_force =
        friction_force.clamp(-law.friction * normal_force, law.friction * normal_force);
    sum.force += normal_force * normal + friction_force * tangent;
    sum.torque -= friction_force * radius;
}

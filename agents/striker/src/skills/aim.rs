//! Aiming of strikes: in which direction the mallet must meet the puck so that the puck leaves in a desired direction.
//! Also the normal distribution, with which the chance of a goal is estimated.

use crate::field::Vec2;
use crate::puck::Puck;

/// The contact normal (mallet to puck) along which a mallet of speed `speed` sends the puck towards
/// `direction`, and the puck just after the strike. `contact_distance` is the distance of the centres at contact. The friction of the
/// contact turns the puck away from the normal, so the normal is found by iteration.
pub fn strike_towards(
    puck: &Puck,
    direction: Vec2,
    speed: f64,
    contact_distance: f64,
) -> (Vec2, Puck) {
    let desired = direction.y.atan2(direction.x);
    let mut angle = desired;
    let mut struck = *puck;
    for _ in 0..6 {
        let normal = Vec2::new(angle.cos(), angle.sin());
        struck = *puck;
        struck.strike(puck.pos - contact_distance * normal, speed * normal);
        let angle_error = wrap(desired - struck.vel.y.atan2(struck.vel.x));
        angle += 0.8 * angle_error.clamp(-0.4, 0.4);
    }
    (Vec2::new(angle.cos(), angle.sin()), struck)
}

/// The same angle in (−π, π].
fn wrap(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * ((angle + std::f64::consts::PI) / turn).floor()
}

/// Standard normal distribution function (logistic approximation, error below 0.01).
pub fn normal_cdf(x: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * x).exp())
}

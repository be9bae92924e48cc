//! Waiting in front of the goal.

use striker::field::Vec2;
use striker::motion::Pace;
use striker::scene::{Order, Scene, around};

/// Goes there around the puck, and a little towards the puck's side.
pub fn guard(scene: &Scene<'_>) -> Order {
    let y = (0.3 * scene.puck.pos.y).clamp(-0.1, 0.1);
    let clearance = scene.field.contact() + 0.03;
    Order::stop(
        scene,
        around(scene, Vec2::new(-0.82, y), clearance),
        Pace::CALM,
    )
}

//! The waiting position of the mallet, in front of the own goal.

use striker::field::Vec2;
use striker::motion::Pace;
use striker::scene::{MalletCommand, Scene, waypoint};

/// Moves around the puck to a point in front of the goal, shifted a little towards the puck's side.
pub fn guard(scene: &Scene<'_>) -> MalletCommand {
    let y = (0.3 * scene.puck.pos.y).clamp(-0.1, 0.1);
    let clearance = scene.field.contact_distance() + 0.03;
    MalletCommand::stop(
        scene,
        waypoint(scene, Vec2::new(-0.82, y), clearance),
        Pace::CALM,
    )
}

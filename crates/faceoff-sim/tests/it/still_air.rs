//! Control steps without air flow.

use faceoff_sim::World;

/// A control step in which the air exerts no force on the puck.
pub fn step_in_still_air(world: &mut World) {
    world.control_step(|_| [0.0; 2]);
}

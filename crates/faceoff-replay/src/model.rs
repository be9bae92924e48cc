//! Constants of the model that are needed to draw a clip.

pub use faceoff_sim::{
    episode::task::{PLAYABLE_Y_M, TASK_RULES},
    model::{CONTROL_STEP_S, TOOL},
    table::geometry::{PUCK, TABLE},
};

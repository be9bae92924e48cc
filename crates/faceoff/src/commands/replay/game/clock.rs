//! The game clock.

use faceoff_types::CONTROL_STEP_S;

/// Time after a number of control steps, s.
pub fn seconds(steps: u32) -> f64 {
    f64::from(steps) * CONTROL_STEP_S
}

/// Minutes and seconds after a number of control steps, such as `1:02.5`; rounded down, like a clock.
pub fn text(steps: u32) -> String {
    let tenths = (f64::from(steps) * CONTROL_STEP_S * 10.0 + 1e-6).floor();
    format!(
        "{}:{:04.1}",
        (tenths / 600.0).floor(),
        (tenths % 600.0) / 10.0
    )
}

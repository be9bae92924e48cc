//! The columns of air hockey's recordings, and the layouts of its actions.

use faceoff_sim::{
    Interpolation,
    episode::constraints::{EE, JOINT_POS, JOINT_VEL, LINK},
};
use faceoff_types::{ActionSpace, RecordingColumn, RecordingColumns};

const PUCK: [&str; 6] = ["x", "y", "yaw", "vx", "vy", "yaw_rate"];
const POSITION: [&str; 3] = ["x", "y", "z"];

/// The columns of recordings. The filtered joint velocities of the true state are not recorded: they follow from the other columns, and
/// would add a tenth to the size of a dataset.
#[must_use]
pub fn recording_columns() -> RecordingColumns {
    let puck = || PUCK.map(|name| RecordingColumn::new(format!("puck_{name}")));
    let joints = |name: &'static str| (1..=7).map(move |joint| format!("{name}_{joint}"));
    let opponent_ee = POSITION.map(|name| RecordingColumn::optional(format!("opponent_ee_{name}")));
    let mut observation: Vec<_> = puck().into();
    let mut state: Vec<_> = puck().into();
    for columns in [&mut observation, &mut state] {
        columns.extend(joints("q").chain(joints("dq")).map(RecordingColumn::new));
    }
    observation.extend(opponent_ee.clone());
    // The two angles of the universal joint, through which the mallet hangs on the arm, and the end effector (`ee`), the arm's tip.
    state.extend(["universal_1", "universal_2", "ee_x", "ee_y", "ee_z"].map(RecordingColumn::new));
    state.extend(joints("opponent_q").map(RecordingColumn::optional));
    state.extend(opponent_ee);
    RecordingColumns {
        observation,
        state,
        limits: vec![JOINT_POS, JOINT_VEL, EE, LINK],
    }
}

/// The layouts of actions: one for each interpolation.
#[must_use]
pub fn action_space() -> ActionSpace {
    ActionSpace {
        agents_choose_layout: true,
        layouts: Interpolation::ALL.map(Into::into).into(),
    }
}

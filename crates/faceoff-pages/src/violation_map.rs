//! Positions of violations of safety limits on the table, with its own mark for each group of limits: end effector, elbow and wrist, joint
//! positions, joint velocities.

use super::{
    episode_text::group_label,
    table_drawing::{self, Position},
};
use faceoff_replay::Group;

/// Marks of the violations of a group.
pub(super) struct ViolationMarks {
    pub(super) label: &'static str,
    pub(super) class: &'static str,
    pub(super) marks: String,
    /// A single mark, for the legend.
    pub(super) symbol: String,
    pub(super) count: usize,
}

impl ViolationMarks {
    /// Marks of each group with violations.
    pub(super) fn by_group(positions: impl Fn(Group) -> Vec<Position>) -> Vec<Self> {
        let groups = Group::ALL.into_iter().filter_map(|group| {
            let found = positions(group);
            let (class, draw): (_, fn(&[Position]) -> String) = match group {
                Group::Ee => ("ee", table_drawing::crosses),
                Group::Link => ("link", table_drawing::squares),
                Group::JointPos => ("joint-pos", table_drawing::dots),
                Group::JointVel => ("joint-vel", table_drawing::triangles),
            };
            (!found.is_empty()).then(|| Self {
                label: group_label(group),
                class,
                marks: draw(&found),
                symbol: draw(&[[0.0; 2]]),
                count: found.len(),
            })
        });
        groups.collect()
    }
}

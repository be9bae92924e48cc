//! Positions of violations of safety limits on the table, with its own mark for each constraint: end effector, elbow and wrist, joint
//! positions, joint velocities.

use super::{
    episode_text::constraint_label,
    table_drawing::{self, Position},
};
use faceoff_replay::Constraint;

/// Marks of the violations of a constraint.
pub(super) struct ViolationMarks {
    pub(super) label: &'static str,
    pub(super) class: &'static str,
    pub(super) marks: String,
    /// A single mark, for the legend.
    pub(super) symbol: String,
    pub(super) count: usize,
}

impl ViolationMarks {
    /// Marks of each constraint with violations.
    pub(super) fn by_constraint(positions: impl Fn(Constraint) -> Vec<Position>) -> Vec<Self> {
        let constraints = Constraint::ALL.into_iter().filter_map(|constraint| {
            let found = positions(constraint);
            let (class, draw): (_, fn(&[Position]) -> String) = match constraint {
                Constraint::Ee => ("ee", table_drawing::crosses),
                Constraint::Link => ("link", table_drawing::squares),
                Constraint::JointPos => ("joint-pos", table_drawing::dots),
                Constraint::JointVel => ("joint-vel", table_drawing::triangles),
            };
            (!found.is_empty()).then(|| Self {
                label: constraint_label(constraint),
                class,
                marks: draw(&found),
                symbol: draw(&[[0.0; 2]]),
                count: found.len(),
            })
        });
        constraints.collect()
    }
}

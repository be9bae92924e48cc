//! Collects what one side (the agent of an episode, or one of a game's two) saw and did: the columns of its observations,
//! commands and computation times, one value per sample (the state after a control step).

use crate::{column::Column, header::TrackingGap, motion::joint_columns};
use faceoff_episode::AnswerTiming;
use faceoff_sim::{Interpolation, JOINTS, model::CONTROL_STEP_S, table::geometry::TABLE};
use std::f64::consts::PI;

// Resolutions: values are stored as multiples of these.
const POSITION_RESOLUTION_M: f64 = 1e-4;
const ANGLE_RESOLUTION_RAD: f64 = 1e-3;
const COMMAND_RESOLUTION_RAD: f64 = 1e-4;
const TIME_RESOLUTION_S: f64 = 1e-5;

// Indices of columns. The observed puck has three (x, y, yaw), the commands one for each joint.
const OBSERVED_PUCK_COLUMN: usize = 0;
const COMMAND_COLUMN: usize = 3;
const COMPUTATION_TIME_COLUMN: usize = COMMAND_COLUMN + JOINTS;
const HOST_INTERFERENCE_COLUMN: usize = COMPUTATION_TIME_COLUMN + 1;

/// The samples of one side; columns of observations start with sample 0 (before the first step), those of answers with sample 1.
#[derive(Debug)]
pub(crate) struct AgentView {
    /// 0 or 1.
    side: u32,
    columns: Vec<Column>,
    /// Samples whose answer took longer than a control step.
    late_samples: Vec<u32>,
    /// Spans in which the simulated tracking had lost the puck.
    tracking_gaps: Vec<TrackingGap>,
}

impl AgentView {
    /// The columns of a side, 0 or 1.
    pub fn new(side: u32) -> Self {
        let mut columns = vec![
            Column::new("seen_x", "m", POSITION_RESOLUTION_M, 1),
            Column::new("seen_y", "m", POSITION_RESOLUTION_M, 1),
            Column::new("seen_yaw", "rad", ANGLE_RESOLUTION_RAD, 1),
        ];
        columns.extend(
            joint_columns("command", "rad", COMMAND_RESOLUTION_RAD, 2)
                .map(|column| column.beginning_at(1)),
        );
        columns.extend(
            ["computation_time", "host_time"]
                .map(|name| Column::new(name, "s", TIME_RESOLUTION_S, 0).beginning_at(1)),
        );
        Self {
            side,
            columns,
            late_samples: Vec::new(),
            tracking_gaps: Vec::new(),
        }
    }

    /// Adds an observation, as sent to the agent.
    pub fn observe(&mut self, observation: &[f64]) {
        let [x, y, yaw, ..] = *observation else {
            return;
        };
        // Converts from the robot's base frame to the table frame; the second robot's base is rotated by half a turn.
        let position = match self.side {
            0 => [x - TABLE.base_x_m, y, yaw],
            _ => [
                TABLE.base_x_m - x,
                -y,
                if yaw > 0.0 { yaw - PI } else { yaw + PI },
            ],
        };
        for (column, value) in self.columns[OBSERVED_PUCK_COLUMN..]
            .iter_mut()
            .zip(position)
        {
            column.push(value);
        }
    }

    pub fn observation_count(&self) -> usize {
        self.columns[OBSERVED_PUCK_COLUMN].counts.len()
    }

    /// Adds the answer that led to a sample.
    pub fn answer(&mut self, sample: u32, action: &[f64], timing: &AnswerTiming, puck_lost: bool) {
        for (column, value) in self.columns[COMMAND_COLUMN..]
            .iter_mut()
            .zip(commanded(action))
        {
            column.push(*value);
        }
        self.columns[COMPUTATION_TIME_COLUMN].push(timing.computation_time_s);
        self.columns[HOST_INTERFERENCE_COLUMN].push(timing.host_time_s);
        if timing.computation_time_s > CONTROL_STEP_S {
            self.late_samples.push(sample);
        }
        if puck_lost {
            match self.tracking_gaps.last_mut() {
                Some(gap) if gap.to + 1 == sample => gap.to = sample,
                _ => self.tracking_gaps.push(TrackingGap {
                    from: sample,
                    to: sample,
                }),
            }
        }
    }

    /// The columns, the late samples, and the tracking gaps. The column for host interference (time that other programs
    /// on the evaluator's machine took) is left out if it has only zeros.
    pub fn take(mut self) -> (Vec<Column>, Vec<u32>, Vec<TrackingGap>) {
        if self.columns[HOST_INTERFERENCE_COLUMN]
            .counts
            .iter()
            .all(|time| *time == 0)
        {
            self.columns.truncate(HOST_INTERFERENCE_COLUMN);
        }
        (self.columns, self.late_samples, self.tracking_gaps)
    }
}

/// The commanded joint positions at the end of the control step, rad.
fn commanded(action: &[f64]) -> &[f64] {
    let trajectory_numbers = Interpolation::Trajectory.len();
    // A trajectory has positions, velocities and accelerations for each substep: take those of the last one. In other
    // actions the positions come first.
    let start = if action.len() == trajectory_numbers {
        trajectory_numbers - 3 * JOINTS
    } else {
        0
    };
    action.get(start..start + JOINTS).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commanded_positions_are_those_at_the_end() {
        let numbers = |n: u32| (0..n).map(f64::from).collect::<Vec<_>>();
        // The numbers of an action: 7 positions; 7 each of positions, velocities and accelerations; 21 for each of 20
        // substeps.
        assert_eq!(commanded(&numbers(7))[6], 6.0);
        assert_eq!(commanded(&numbers(21))[0], 0.0, "positions come first");
        assert_eq!(commanded(&numbers(420))[0], 399.0, "of the last substep");
    }

    #[test]
    fn observed_puck_is_in_the_table_frame() {
        let mut sides = [AgentView::new(0), AgentView::new(1)];
        // The puck at x = 0.3 m, y = 0.2 m, seen from both bases, which are at x = ±1.51 m.
        sides[0].observe(&[1.51 + 0.3, 0.2, 1.0, 0.0]);
        sides[1].observe(&[1.51 - 0.3, -0.2, 1.0 - PI, 0.0]);
        let positions = sides.map(|side| {
            let position: Vec<f64> = side.columns[..3].iter().flat_map(Column::values).collect();
            position
        });
        for (first, second) in positions[0].iter().zip(&positions[1]) {
            assert!((first - second).abs() < 1e-3, "{positions:?}");
        }
    }
}

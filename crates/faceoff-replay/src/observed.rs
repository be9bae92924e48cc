//! The columns of what a side was told and commanded, and how long it took.

use crate::{column::Column, header::Lost, motion::joints};
use faceoff_episode::Answered;
use faceoff_sim::{JOINTS, model::CONTROL_STEP_S, table::geometry::TABLE};
use faceoff_types::Interpolation;
use std::f64::consts::PI;

const PLACE: f64 = 1e-4;
/// rad.
const ANGLE: f64 = 1e-3;
const COMMAND: f64 = 1e-4;
const TIME: f64 = 1e-5;

/// Where each column is.
const SEEN: usize = 0;
const COMMANDED: usize = 3;
const COMPUTATION_TIME: usize = COMMANDED + JOINTS;
const HOST_TIME: usize = COMPUTATION_TIME + 1;

/// The samples of one side.
#[derive(Debug)]
pub(crate) struct Observed {
    side: u32,
    columns: Vec<Column>,
    late: Vec<u32>,
    lost: Vec<Lost>,
}

impl Observed {
    /// Of a side, 0 or 1.
    pub fn new(side: u32) -> Self {
        let mut columns = vec![
            Column::new("seen_x", "m", PLACE, 1),
            Column::new("seen_y", "m", PLACE, 1),
            Column::new("seen_yaw", "rad", ANGLE, 1),
        ];
        columns.extend(joints("command", "rad", COMMAND, 2).map(|column| column.beginning_at(1)));
        columns.extend(
            ["computation_time", "host_time"]
                .map(|name| Column::new(name, "s", TIME, 0).beginning_at(1)),
        );
        Self {
            side,
            columns,
            late: Vec::new(),
            lost: Vec::new(),
        }
    }

    /// What the side is told at the next sample, as its agent gets it.
    pub fn see(&mut self, observation: &[f64]) {
        let [x, y, yaw, ..] = *observation else {
            return;
        };
        // Of the table, not of the robot's base: the second robot stands opposite, turned by half a turn.
        let place = match self.side {
            0 => [x - TABLE.base_x_m, y, yaw],
            _ => [
                TABLE.base_x_m - x,
                -y,
                if yaw > 0.0 { yaw - PI } else { yaw + PI },
            ],
        };
        for (column, value) in self.columns[SEEN..].iter_mut().zip(place) {
            column.push(value);
        }
    }

    /// How many samples it was told.
    pub fn seen(&self) -> usize {
        self.columns[SEEN].counts.len()
    }

    /// Its answer, which led to a sample.
    pub fn answer(&mut self, sample: u32, action: &[f64], answered: &Answered, puck_lost: bool) {
        for (column, value) in self.columns[COMMANDED..].iter_mut().zip(commanded(action)) {
            column.push(*value);
        }
        self.columns[COMPUTATION_TIME].push(answered.computation_time_s);
        self.columns[HOST_TIME].push(answered.host_time_s);
        if answered.computation_time_s > CONTROL_STEP_S {
            self.late.push(sample);
        }
        if puck_lost {
            match self.lost.last_mut() {
                Some(lost) if lost.to + 1 == sample => lost.to = sample,
                _ => self.lost.push(Lost {
                    from: sample,
                    to: sample,
                }),
            }
        }
    }

    /// What was recorded: columns, late samples, and when the puck was lost.
    pub fn take(mut self) -> (Vec<Column>, Vec<u32>, Vec<Lost>) {
        if self.columns[HOST_TIME].counts.iter().all(|time| *time == 0) {
            self.columns.truncate(HOST_TIME);
        }
        (self.columns, self.late, self.lost)
    }
}

/// The joint positions that an action asks for at the end of its control step, rad.
fn commanded(action: &[f64]) -> &[f64] {
    let whole = Interpolation::Trajectory.len();
    // A whole trajectory's last substep; else positions come first (PROTOCOL).
    let from = if action.len() == whole {
        whole - 3 * JOINTS
    } else {
        0
    };
    action.get(from..from + JOINTS).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_action_asks_for_the_positions_at_its_end() {
        let numbers = |n: u32| (0..n).map(f64::from).collect::<Vec<_>>();
        assert_eq!(commanded(&numbers(7))[6], 6.0);
        assert_eq!(commanded(&numbers(21))[0], 0.0, "positions come first");
        assert_eq!(commanded(&numbers(420))[0], 399.0, "of the last substep");
    }

    #[test]
    fn each_side_sees_the_puck_on_the_table() {
        let mut sides = [Observed::new(0), Observed::new(1)];
        sides[0].see(&[1.51 + 0.3, 0.2, 1.0, 0.0]);
        sides[1].see(&[1.51 - 0.3, -0.2, 1.0 - PI, 0.0]);
        let places = sides.map(|side| {
            let place: Vec<f64> = side.columns[..3].iter().flat_map(Column::values).collect();
            place
        });
        for (one, other) in places[0].iter().zip(&places[1]) {
            assert!((one - other).abs() < 1e-3, "{places:?}");
        }
    }
}

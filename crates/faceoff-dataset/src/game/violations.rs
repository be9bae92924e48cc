//! Violations of constraints in a side's table of steps.

use super::table::GameTable;
use crate::error::DatasetError;
use arrow_array::{cast::AsArray as _, types::Float64Type};
use faceoff_replay::Constraint;
use faceoff_types::ViolationName;

/// A violation of a constraint in successive samples. Sample k is the state after k control steps of the game.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    pub name: ViolationName,
    /// The first and the last sample.
    pub samples: [u32; 2],
    /// Largest excess over the limit: rad, rad/s or m.
    pub max_excess: f64,
}

impl Violation {
    /// The violations in a side's table, in the order of their first sample.
    pub(super) fn read(mut steps: GameTable) -> Result<Vec<Self>, DatasetError> {
        let mut violations = Vec::new();
        let mut current: [Option<Self>; Constraint::ALL.len()] = [None; Constraint::ALL.len()];
        let mut sample = 0;
        while let rows @ 1.. = steps.fill()? {
            let Some(batch) = steps.take(rows) else { break };
            let columns = Constraint::ALL.map(|constraint| {
                batch[&*format!("constraint_{}", constraint.name())].as_primitive::<Float64Type>()
            });
            for row in 0..batch.num_rows() {
                sample += 1;
                for ((constraint, column), current) in
                    Constraint::ALL.into_iter().zip(columns).zip(&mut current)
                {
                    let value = column.value(row);
                    if value > 0.0 {
                        let violation = current.get_or_insert(Self {
                            name: constraint.name(),
                            samples: [sample; 2],
                            max_excess: value,
                        });
                        violation.samples[1] = sample;
                        violation.max_excess = violation.max_excess.max(value);
                    } else {
                        violations.extend(current.take());
                    }
                }
            }
        }
        violations.extend(current.into_iter().flatten());
        violations.sort_by_key(|violation| violation.samples);
        Ok(violations)
    }
}

//! Joins violations of constraints in successive samples (states after control steps) to spans.

use crate::{constraint::Constraint, header::ViolationSpan};
use faceoff_sim::ConstraintValues;

/// Collects the violations of a side.
#[derive(Debug, Clone, Default)]
pub(crate) struct ViolationTracker {
    /// Spans that the last sample belongs to, for each [`Constraint`].
    current: [Option<ViolationSpan>; 4],
    finished: Vec<ViolationSpan>,
}

impl ViolationTracker {
    /// Adds the values of a sample.
    pub fn update(&mut self, side: u32, sample: u32, values: &ConstraintValues) {
        for (constraint, current) in Constraint::ALL.into_iter().zip(&mut self.current) {
            let value = constraint.value(values);
            if value > 0.0 {
                let span = current.get_or_insert(ViolationSpan {
                    side,
                    constraint,
                    from: sample,
                    to: sample,
                    max_excess: value,
                });
                span.to = sample;
                span.max_excess = span.max_excess.max(value);
            } else {
                self.finished.extend(current.take());
            }
        }
    }

    /// Removes and returns all violations so far, in the order of their first sample.
    pub fn take(&mut self) -> Vec<ViolationSpan> {
        let mut all = std::mem::take(&mut self.finished);
        all.extend(self.current.iter_mut().filter_map(Option::take));
        all.sort_by_key(|span| (span.from, span.constraint));
        all
    }
}

//! When constraints were broken.

use crate::{group::Group, header::ViolationTold};
use faceoff_sim::ConstraintValues;

/// The violations of a side, as they come.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watch {
    under_way: [Option<ViolationTold>; 4],
    over: Vec<ViolationTold>,
}

impl Watch {
    /// Takes note of the values at a sample.
    pub fn see(&mut self, side: u32, sample: u32, values: &ConstraintValues) {
        for (group, under_way) in Group::ALL.into_iter().zip(&mut self.under_way) {
            let value = group.of(values);
            if value > 0.0 {
                let told = under_way.get_or_insert(ViolationTold {
                    side,
                    group,
                    from: sample,
                    to: sample,
                    worst: value,
                });
                told.to = sample;
                told.worst = told.worst.max(value);
            } else {
                self.over.extend(under_way.take());
            }
        }
    }

    /// All so far, in order of their first sample; they are forgotten.
    pub fn take(&mut self) -> Vec<ViolationTold> {
        let mut all = std::mem::take(&mut self.over);
        all.extend(self.under_way.iter_mut().filter_map(Option::take));
        all.sort_by_key(|told| (told.from, told.group));
        all
    }
}

//! When constraints were broken.

use crate::header::ViolationTold;
use faceoff_sim::ConstraintValues;
use serde::{Deserialize, Serialize};

/// A group of constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub enum Group {
    /// The end effector's place, m.
    Ee,
    /// Height of elbow and wrist, m.
    Link,
    /// Joint positions, rad.
    JointPos,
    /// Joint velocities, rad/s.
    JointVel,
}

impl Group {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Ee, Self::Link, Self::JointPos, Self::JointVel];

    /// Its value, above 0 if broken.
    #[must_use]
    pub const fn of(self, values: &ConstraintValues) -> f64 {
        match self {
            Self::Ee => values.ee,
            Self::Link => values.link,
            Self::JointPos => values.joint_pos,
            Self::JointVel => values.joint_vel,
        }
    }
}

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

use crate::{NotPaired, Played};
use faceoff_types::Task;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Of two evaluations on the same episodes of one task, the episodes by who solved them, in their order.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct WhoSolved {
    /// Episodes that both solved.
    pub both: Vec<u32>,
    /// Episodes that only A solved.
    pub only_a: Vec<u32>,
    /// Episodes that only B solved.
    pub only_b: Vec<u32>,
    /// Episodes that neither solved.
    pub neither: Vec<u32>,
}

impl Played<'_> {
    /// Which episodes this one (A) and another evaluation that met the same ones (B) solved.
    ///
    /// # Errors
    /// If it did not: the field that differs.
    pub fn who_solved(&self, other: &Self) -> Result<BTreeMap<Task, WhoSolved>, NotPaired> {
        // Whether they met the same episodes is asked in one place.
        self.compare(other)?;
        let sides = self.summary.tasks.iter().zip(other.summary.tasks.values());
        Ok(sides
            .map(|((task, a), b)| {
                let mut by_whom = WhoSolved::default();
                let solved = a
                    .successes
                    .episodes_solved()
                    .zip(b.successes.episodes_solved());
                for (episode, solved) in (0..).zip(solved) {
                    let list = match solved {
                        (true, true) => &mut by_whom.both,
                        (true, false) => &mut by_whom.only_a,
                        (false, true) => &mut by_whom.only_b,
                        (false, false) => &mut by_whom.neither,
                    };
                    list.push(episode);
                }
                (*task, by_whom)
            })
            .collect())
    }
}

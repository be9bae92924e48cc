//! The episodes that each of two compared evaluations solved, by number.

use crate::{ComparedEvaluation, NotComparable};
use faceoff_types::TaskMap;
use serde::{Deserialize, Serialize};

/// Numbers of the episodes of one task, by which of two evaluations (A and B) solved them; each list is ascending.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SolvedEpisodes {
    /// Episodes that both solved.
    pub both: Vec<u32>,
    /// Episodes that only A solved.
    pub only_a: Vec<u32>,
    /// Episodes that only B solved.
    pub only_b: Vec<u32>,
    /// Episodes that neither solved.
    pub neither: Vec<u32>,
}

impl ComparedEvaluation<'_> {
    /// The solved episodes of this evaluation (A) and of another one on the same episodes (B), by task.
    ///
    /// # Errors
    /// If the episodes are not the same: the field that differs.
    pub fn solved_episodes(&self, other: &Self) -> Result<TaskMap<SolvedEpisodes>, NotComparable> {
        // Checks that the episodes are the same.
        self.compare(other)?;
        let others = &other.summary.tasks;
        let tasks = self.summary.tasks.iter();
        let tasks = tasks.filter_map(|(task, a)| Some((task, a, others.get(task)?)));
        Ok(tasks
            .map(|(task, a, b)| {
                let mut lists = SolvedEpisodes::default();
                let solved = a.successes.iter().zip(b.successes.iter());
                for (episode, solved) in (0..).zip(solved) {
                    let list = match solved {
                        (true, true) => &mut lists.both,
                        (true, false) => &mut lists.only_a,
                        (false, true) => &mut lists.only_b,
                        (false, false) => &mut lists.neither,
                    };
                    list.push(episode);
                }
                (*task, lists)
            })
            .collect())
    }
}

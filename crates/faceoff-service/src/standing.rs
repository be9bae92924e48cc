//! What a board's rows are made of, and the rows that were made last: of a stage whose best day counts they are chosen
//! from thousands of results, and change some times a day.

use crate::problem::Problem;
use faceoff_scoring::mean_result;
use faceoff_store::{BoardRecord, Store};
use faceoff_types::{EvaluationId, RunId, StageId, Standings, Task};
use jiff::{Timestamp, civil::Date};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
};

/// Boards whose rows are kept; a season has some stages, each with a few revisions and four boards.
const KEPT: usize = 100;

/// What a row is made of.
#[derive(Debug, Clone)]
pub struct Standing {
    /// The newest of its evaluations; of a mean, with the mean as its result.
    pub record: BoardRecord,
    /// All of them, the earlier day first.
    pub evaluations: Vec<EvaluationId>,
    pub runs: Vec<RunId>,
}

impl Standing {
    pub fn alone(record: BoardRecord) -> Self {
        Self {
            evaluations: vec![record.evaluation],
            runs: vec![record.run],
            record,
        }
    }

    /// Of a team's evaluations, the earlier day first; `None` of none.
    pub fn mean(mut records: Vec<BoardRecord>) -> Result<Option<Self>, Problem> {
        let results: Vec<_> = records.iter().map(|record| &record.result).collect();
        let Some(result) = mean_result(&results).map_err(Problem::internal)? else {
            return Ok(None);
        };
        let evaluations = records.iter().map(|record| record.evaluation).collect();
        let runs = records.iter().map(|record| record.run).collect();
        // What is told of the days' episodes is told of none before all are released.
        let all_released = records.iter().all(|record| record.released_at.is_some());
        let newest = records.pop();
        Ok(newest.map(|newest| Self {
            record: BoardRecord {
                released_at: newest.released_at.filter(|_| all_released),
                result,
                ..newest
            },
            evaluations,
            runs,
        }))
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RowsOf {
    pub stage: StageId,
    pub revision: u32,
    pub by: Standings,
    pub task: Option<Task>,
    /// Of results until then.
    pub until: Option<Timestamp>,
    /// Of days until then.
    pub(crate) until_day: Option<Date>,
}

/// By board the rows, and the id of the newest change that they have.
type Boards = HashMap<RowsOf, (i64, Arc<[Standing]>)>;

/// The rows of boards as they were after some change of the season; any other may have changed them.
#[derive(Debug)]
pub struct KeptRows {
    store: Store,
    boards: Mutex<Boards>,
}

impl KeptRows {
    pub fn new(store: Store) -> Self {
        Self {
            store,
            boards: Mutex::default(),
        }
    }

    /// The rows that were kept since the newest change; else those that `make` makes, which are kept.
    pub async fn get(
        &self,
        of: RowsOf,
        make: impl AsyncFnOnce() -> Result<Vec<Standing>, Problem>,
    ) -> Result<Vec<Standing>, Problem> {
        // Before the rows are read: a change in between makes them anew next time, though they have it.
        let change = self.store.newest_change().await?;
        let kept = self.lock().get(&of).cloned();
        if let Some((_, rows)) = kept.filter(|(kept_at, _)| *kept_at == change) {
            return Ok(rows.to_vec());
        }
        let rows = make().await?;
        let mut boards = self.lock();
        if boards.len() >= KEPT && !boards.contains_key(&of) {
            boards.clear();
        }
        boards.insert(of, (change, rows.clone().into()));
        Ok(rows)
    }

    fn lock(&self) -> MutexGuard<'_, Boards> {
        // whoever panicked left whole entries behind
        self.boards
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

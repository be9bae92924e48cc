//! Board rows aggregated from several evaluations, and a cache of them. A board ranks the teams of a stage, with one row per
//! team. Depending on the stage, a row shows one evaluation of the team or the mean of several. Selecting each team's best
//! evaluation means reading thousands of results, which change only a few times a day.

use crate::problem::Problem;
use faceoff_scoring::mean_result;
use faceoff_store::{BoardRecord, Store};
use faceoff_types::{CountingResult, EvaluationId, RunId, StageId, Task};
use jiff::{Timestamp, civil::Date};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
};

/// Boards in the cache. A season has some stages, each with a few revisions of its rules, and each revision has four boards:
/// one for all tasks together and one per task.
const MAX_BOARDS: usize = 100;

/// A team's row, aggregated from the evaluations that count on the board.
#[derive(Debug, Clone)]
pub struct AggregatedRow {
    /// The newest evaluation; for a mean, with the mean as its result.
    pub record: BoardRecord,
    /// All evaluations that count, in order of their days.
    pub evaluations: Vec<EvaluationId>,
    /// The run (all episodes of one evaluation) of each of these evaluations.
    pub runs: Vec<RunId>,
}

impl AggregatedRow {
    /// The row of a single evaluation.
    pub fn single(record: BoardRecord) -> Self {
        Self {
            evaluations: vec![record.evaluation],
            runs: vec![record.run],
            record,
        }
    }

    /// The mean of a team's evaluations, which are in order of their days; `None` if there are none.
    pub fn mean(mut records: Vec<BoardRecord>) -> Result<Option<Self>, Problem> {
        let results: Vec<_> = records.iter().map(|record| &record.result).collect();
        let Some(result) = mean_result(&results).map_err(Problem::internal)? else {
            return Ok(None);
        };
        let evaluations = records.iter().map(|record| record.evaluation).collect();
        let runs = records.iter().map(|record| record.run).collect();
        // Data about the episodes stays hidden until all days are released.
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

/// Everything that determines the rows of a board.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RowsKey {
    pub stage: StageId,
    /// Number of the revision of the stage's rules.
    pub revision: u32,
    pub counting_result: CountingResult,
    /// `None`: all tasks together.
    pub task: Option<Task>,
    /// Only results of evaluations that finished up to this time.
    pub finished_until: Option<Timestamp>,
    /// Only results of days up to this one.
    pub(crate) last_day: Option<Date>,
}

/// The rows of each board, with the id of the newest change of the season that they include.
type Boards = HashMap<RowsKey, (i64, Arc<[AggregatedRow]>)>;

/// Cache of board rows. Each change of the season may change them.
#[derive(Debug)]
pub struct RowCache {
    store: Store,
    boards: Mutex<Boards>,
}

impl RowCache {
    pub fn new(store: Store) -> Self {
        Self {
            store,
            boards: Mutex::default(),
        }
    }

    /// The cached rows, if they include the newest change; otherwise calls `compute` and caches its rows.
    pub async fn get(
        &self,
        key: RowsKey,
        compute: impl AsyncFnOnce() -> Result<Vec<AggregatedRow>, Problem>,
    ) -> Result<Vec<AggregatedRow>, Problem> {
        // Read before the rows: a change in between invalidates the entry, though the rows may already include it.
        let change = self.store.newest_change().await?;
        let cached = self.lock().get(&key).cloned();
        if let Some((_, rows)) = cached.filter(|(cached_change, _)| *cached_change == change) {
            return Ok(rows.to_vec());
        }
        let rows = compute().await?;
        let mut boards = self.lock();
        if boards.len() >= MAX_BOARDS && !boards.contains_key(&key) {
            boards.clear();
        }
        boards.insert(key, (change, rows.clone().into()));
        Ok(rows)
    }

    fn lock(&self) -> MutexGuard<'_, Boards> {
        // A panic cannot leave an incomplete entry behind.
        self.boards
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

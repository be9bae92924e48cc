//! Board rows aggregated from several evaluations. A board ranks the teams of a stage, with one row per team. Depending on the
//! stage, a row shows one evaluation of the team or the mean of several. Selecting each team's best evaluation means reading
//! thousands of results, which change only a few times a day, so rows are cached.

use crate::problem::Problem;
use faceoff_scoring::mean_result;
use faceoff_store::BoardRecord;
use faceoff_types::{Competition, CountingResult, EvaluationId, RunId, StageId, Task};
use jiff::{Timestamp, civil::Date};

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
    pub fn mean(
        mut records: Vec<BoardRecord>,
        competition: &Competition,
    ) -> Result<Option<Self>, Problem> {
        let Some(first) = records.first() else {
            return Ok(None);
        };
        let weights = competition.weights(&first.result.variation);
        let bounds = competition.tier_bounds(&first.result.variation);
        let results: Vec<_> = records.iter().map(|record| &record.result).collect();
        let mean = mean_result(&results, &weights, bounds).map_err(Problem::internal)?;
        let Some(result) = mean else {
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
    /// The newest change of the season that the rows include.
    pub change: i64,
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

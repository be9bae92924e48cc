//! Queries of evaluations: a team's runs of all tasks on a day, with their progress.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    store::Store,
    tables::{
        evaluations::{self, Evaluation, EvaluationRow},
        run_progress::{self, RunProgress},
    },
};
use faceoff_types::{EvaluationId, StageDay, TeamId};
use jiff::{Timestamp, civil::Date};
use sqlx::SqliteConnection;

/// Turns rows into evaluations by `convert`, which is given the progress of a running one.
pub(super) async fn with_progress_by<T>(
    connection: &mut SqliteConnection,
    rows: Vec<EvaluationRow>,
    convert: fn(EvaluationRow, RunProgress) -> Result<T>,
) -> Result<Vec<T>> {
    let running: Vec<_> = rows.iter().filter_map(EvaluationRow::open_run).collect();
    let mut by_run = run_progress::of_runs(connection, &running).await?;
    rows.into_iter()
        .map(|row| {
            let run = row.open_run();
            let progress = run.and_then(|run| by_run.remove(&run));
            convert(row, progress.unwrap_or_default())
        })
        .collect()
}

async fn with_progress(
    connection: &mut SqliteConnection,
    rows: Vec<EvaluationRow>,
) -> Result<Vec<Evaluation>> {
    with_progress_by(connection, rows, EvaluationRow::into_evaluation).await
}

/// One evaluation with its progress.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<Evaluation> {
    let row = evaluations::find(connection, id).await?;
    let mut evaluations = with_progress(connection, vec![row]).await?;
    evaluations.pop().ok_or(StoreError::NotFound("evaluation"))
}

/// The evaluations that a list contains, and their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EvaluationFilter {
    /// The evaluations of a team, on one date or on all dates, the newest first.
    Team(TeamId, Option<Date>),
    /// The evaluations of all stages on a date, in the order in which they were queued.
    Day(Date),
}

impl Store {
    /// One page of a list: its first evaluations, or those that follow the evaluation `after`. `None` if there is no
    /// evaluation `after`.
    #[boxed_future]
    pub async fn evaluations_after(
        &self,
        filter: EvaluationFilter,
        after: Option<EvaluationId>,
        limit: u32,
    ) -> Result<Option<Vec<Evaluation>>> {
        let mut tx = self.database.read.begin().await?;
        let start = match after {
            None => None,
            Some(id) => match evaluations::created_at(&mut tx, id).await? {
                Some(at) => Some((at, Some(id))),
                None => return Ok(None),
            },
        };
        let rows = match filter {
            EvaluationFilter::Team(team, date) => {
                let start = start.unwrap_or((Timestamp::MAX, None));
                evaluations::of_team_after(&mut tx, team, date, start, limit).await?
            }
            EvaluationFilter::Day(date) => {
                let start = start.unwrap_or((Timestamp::UNIX_EPOCH, None));
                evaluations::on_date_after(&mut tx, date, start, limit).await?
            }
        };
        with_progress(&mut tx, rows).await.map(Some)
    }

    /// The evaluation with this id.
    #[boxed_future]
    pub async fn evaluation(&self, id: EvaluationId) -> Result<Evaluation> {
        find(&mut *self.database.read.begin().await?, id).await
    }

    /// A team's evaluations, the newest first.
    #[boxed_future]
    pub async fn evaluations_of(&self, team: TeamId) -> Result<Vec<Evaluation>> {
        let mut tx = self.database.read.begin().await?;
        let rows = evaluations::of_team(&mut tx, team).await?;
        with_progress(&mut tx, rows).await
    }

    /// The evaluations of a stage on one day, in the order in which they were queued.
    #[boxed_future]
    pub async fn evaluations_of_day(&self, stage_day: StageDay) -> Result<Vec<Evaluation>> {
        let mut tx = self.database.read.begin().await?;
        let rows = evaluations::of_day(&mut tx, stage_day).await?;
        with_progress(&mut tx, rows).await
    }

    /// The evaluations of all stages on this date, in the order in which they were queued.
    #[boxed_future]
    pub async fn evaluations_on(&self, date: Date) -> Result<Vec<Evaluation>> {
        let mut tx = self.database.read.begin().await?;
        let first = (Timestamp::UNIX_EPOCH, None);
        let rows = evaluations::on_date_after(&mut tx, date, first, u32::MAX).await?;
        with_progress(&mut tx, rows).await
    }
}

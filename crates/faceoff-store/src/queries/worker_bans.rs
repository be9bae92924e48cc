//! Queries of banned remote workers (on other machines), and of the results to which a worker has contributed.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::worker_bans::{self, WorkerBan},
};
use faceoff_types::{EvaluationId, GameId, WorkerName};

/// Finished results to which a worker has contributed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WorkerResults {
    /// Finished evaluations that are not voided, the newest first.
    pub evaluations: Vec<EvaluationId>,
    /// Games whose result counts, the newest first.
    pub games: Vec<GameId>,
}

impl Store {
    /// All banned workers, by name.
    #[boxed_future]
    pub async fn worker_bans(&self) -> Result<Vec<WorkerBan>> {
        worker_bans::all(&mut *self.database.read.acquire().await?).await
    }

    /// Why the worker is banned; `None` if it is not.
    #[boxed_future]
    pub async fn ban_reason(&self, worker: &WorkerName) -> Result<Option<String>> {
        worker_bans::reason(&mut *self.database.read.acquire().await?, worker.as_str()).await
    }

    /// The counting results to which a remote worker has contributed, at most `limit` of each kind.
    #[boxed_future]
    pub async fn results_of_worker(
        &self,
        worker: &WorkerName,
        limit: u32,
    ) -> Result<WorkerResults> {
        let holder = worker.holder();
        let mut connection = self.database.read.acquire().await?;
        // A prefix is tested by two comparisons: from `remote/` to `remote0`, since the character 0 follows /. The first pair makes
        // the partial index of jobs that remote workers have done usable; the second one selects this worker's slots.
        let evaluations = sqlx::query_scalar!(
            r#"SELECT e.id AS "id!"
               FROM jobs j JOIN shards s ON s.job_id = j.id JOIN counting_evaluations e ON e.run_id = s.run_id
               WHERE j.state = 'done' AND j.worker >= 'remote/' AND j.worker < 'remote0'
                 AND j.worker >= ?1 || '/' AND j.worker < ?1 || '0'
                 AND e.state = 'finished' AND e.voided_at IS NULL
               GROUP BY e.id ORDER BY MAX(e.finished_at) DESC LIMIT ?2"#,
            holder,
            limit,
        )
        .fetch_all(&mut *connection)
        .await?;
        let games = sqlx::query_scalar!(
            r#"SELECT g.id AS "id!" FROM games g
               JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt
               WHERE a.worker >= ?1 || '/' AND a.worker < ?1 || '0'
               ORDER BY a.ended_at DESC LIMIT ?2"#,
            holder,
            limit,
        )
        .fetch_all(&mut *connection)
        .await?;
        Ok(WorkerResults { evaluations, games })
    }
}

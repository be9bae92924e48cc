//! Queries of ablations: runs of a submission without perturbations, with each one alone, and with all.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::{
        ablations::{self, Ablation, AblationRow, AblationState},
        run_progress::{self, RunProgress},
        runs,
    },
};
use faceoff_types::{AblationId, ProfileMap, SubmissionId};
use sqlx::SqliteConnection;

/// The newest ablation of a submission with its runs and their progress.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<Option<Ablation>> {
    match ablations::newest(connection, submission).await? {
        Some(row) => from_row(connection, row).await.map(Some),
        None => Ok(None),
    }
}

async fn from_row(connection: &mut SqliteConnection, row: AblationRow) -> Result<Ablation> {
    let (id, submission) = (row.id, row.submission_id);
    let (mut run_by_profile, mut episodes_total, mut episodes_per_task) = (ProfileMap::new(), 0, 0);
    for run in ablations::runs(connection, id).await? {
        let plan = runs::find(connection, run).await?.plan;
        episodes_total += plan.episodes_total();
        episodes_per_task = plan.episodes_per_task;
        run_by_profile.insert(plan.profile, run);
    }
    let state = match (row.finished_at, row.reason) {
        (None, _) => {
            let runs: Vec<_> = run_by_profile.values().copied().collect();
            let mut progress = RunProgress::default();
            for run in run_progress::of_runs(connection, &runs)
                .await?
                .into_values()
            {
                progress.add(run);
            }
            AblationState::Unfinished {
                progress,
                episodes_total,
            }
        }
        (Some(at), None) => AblationState::Finished { finished_at: at.0 },
        (Some(at), Some(reason)) => AblationState::Failed {
            finished_at: at.0,
            reason,
        },
    };
    Ok(Ablation {
        id,
        submission,
        runs: run_by_profile,
        episodes_per_task,
        created_at: row.created_at.0,
        state,
    })
}

impl Store {
    /// An ablation; [`StoreError::NotFound`](crate::StoreError::NotFound) if the id is unknown.
    #[boxed_future]
    pub async fn ablation(&self, id: AblationId) -> Result<Ablation> {
        let mut connection = self.database.read.begin().await?;
        let row = ablations::find(&mut connection, id).await?;
        from_row(&mut connection, row).await
    }

    /// The newest ablation of a submission, if it has any.
    #[boxed_future]
    pub async fn newest_ablation(&self, submission: SubmissionId) -> Result<Option<Ablation>> {
        newest(&mut *self.database.read.begin().await?, submission).await
    }
}

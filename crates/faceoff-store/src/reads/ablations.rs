use crate::{
    error::Result,
    reads::progress,
    store::Store,
    tables::{
        ablations::{self, Ablation, AblationState},
        runs,
    },
};
use faceoff_types::SubmissionId;
use sqlx::SqliteConnection;
use std::collections::BTreeMap;

/// The newest ablation of a submission with its runs and their progress.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<Option<Ablation>> {
    let Some(row) = ablations::newest(connection, submission).await? else {
        return Ok(None);
    };
    let id = row.id.0;
    let (mut of_profile, mut episodes_total, mut episodes_per_task) = (BTreeMap::new(), 0, 0);
    for run in ablations::runs(connection, id).await? {
        let plan = runs::find(connection, run).await?.plan;
        episodes_total += plan.episodes_total();
        episodes_per_task = plan.episodes_per_task;
        of_profile.insert(plan.profile, run);
    }
    let state = match (row.finished_at, row.reason) {
        (None, _) => {
            let runs: Vec<_> = of_profile.values().copied().collect();
            let done = progress::of_runs(connection, &runs).await?;
            AblationState::Open {
                episodes_done: done.into_values().sum(),
                episodes_total,
            }
        }
        (Some(at), None) => AblationState::Finished { finished_at: at.0 },
        (Some(at), Some(reason)) => AblationState::Failed {
            finished_at: at.0,
            reason,
        },
    };
    Ok(Some(Ablation {
        id,
        submission,
        runs: of_profile,
        episodes_per_task,
        created_at: row.created_at.0,
        state,
    }))
}

impl Store {
    /// The newest ablation of a submission, if there was one.
    pub async fn newest_ablation(&self, submission: SubmissionId) -> Result<Option<Ablation>> {
        newest(&mut *self.database.read.begin().await?, submission).await
    }
}

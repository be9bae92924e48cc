//! Runs from their cut into shards to their last one: the same for whoever owns them.

use crate::{
    error::{Result, StoreError},
    event::Subject,
    queue::{self, NewUnit},
    tables::{
        ablations, bundles, drafts, evaluations, runs,
        runs::Run,
        shards::{self, Shard},
    },
    write::Tx,
};
use faceoff_types::{AblationId, EvaluationId, ProposalId, RunId, ShardId, SubmissionId, TeamId};
use sqlx::SqliteConnection;

/// What a run is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunOwner {
    Evaluation(EvaluationId),
    /// One profile of it.
    Ablation(AblationId),
    /// All of one that does not count.
    Draft {
        /// Of the evaluation that it becomes.
        id: EvaluationId,
        /// What it is a part of.
        proposal: ProposalId,
    },
}

impl RunOwner {
    pub(crate) const fn subject(self) -> Subject {
        match self {
            Self::Evaluation(id) => Subject::Evaluation(id),
            Self::Ablation(id) => Subject::Ablation(id),
            Self::Draft { proposal, .. } => Subject::Proposal(proposal),
        }
    }
}

/// What the events of a run's playing are about: of one that was played before it counted, what it was a part of then.
pub(crate) async fn subjects(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Vec<Subject>> {
    let mut subjects = vec![owner(connection, run).await?.subject()];
    if let Some((id, proposal)) = drafts::of_run(connection, run).await? {
        subjects.push(RunOwner::Draft { id, proposal }.subject());
    }
    Ok(subjects)
}

/// What owns a run.
pub(crate) async fn owner(connection: &mut SqliteConnection, run: RunId) -> Result<RunOwner> {
    if let Some(id) = evaluations::of_run(connection, run).await? {
        return Ok(RunOwner::Evaluation(id));
    }
    if let Some((id, proposal)) = drafts::of_run(connection, run).await? {
        return Ok(RunOwner::Draft { id, proposal });
    }
    ablations::of_run(connection, run)
        .await?
        .map(RunOwner::Ablation)
        .ok_or_else(|| StoreError::Damaged(format!("run {run}: nothing owns it")))
}

/// Adds a run, cuts it into shards, in (task, first episode) order, and queues them; their slot time is
/// charged to `team`. [`StoreError::Conflict`] if the archive of a contestant was removed.
pub(crate) async fn create(
    tx: &mut Tx,
    run: &Run,
    contestants: &[SubmissionId],
    unit: NewUnit,
    team: TeamId,
) -> Result<()> {
    for contestant in contestants {
        bundles::check_kept(tx, *contestant).await?;
    }
    runs::insert(tx, run, contestants).await?;
    let account = queue::account(tx, unit.lane, &team.to_string()).await?;
    let mut tasks = run.plan.tasks.clone();
    tasks.sort_unstable();
    let mut position = 0;
    for task in tasks {
        let mut first_episode = 0;
        while first_episode < run.plan.episodes_per_task {
            let end_episode = run
                .plan
                .episodes_per_task
                .min(first_episode.saturating_add(run.plan.episodes_per_shard));
            let shard = Shard {
                id: ShardId::new(),
                task,
                first_episode,
                end_episode,
                recording: None,
            };
            let unit = queue::insert(tx, unit, account).await?;
            shards::insert(tx, run.id, &shard, position, unit).await?;
            position += 1;
            first_episode = end_episode;
        }
    }
    Ok(())
}

/// Takes what is left of a run out of the queue.
pub(crate) async fn stop(tx: &mut Tx, run: RunId) -> Result<()> {
    let open = shards::open_units(tx, run).await?;
    queue::drop_units(tx, &open).await?;
    runs::set_stopped(tx, run).await
}

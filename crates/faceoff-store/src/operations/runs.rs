//! Runs: the playing of a plan of episodes for an owner, which is an evaluation or an ablation. A run is divided into
//! shards, each of which is one job.

use crate::{
    error::{Result, StoreError},
    event::Subject,
    queue::{self, NewJob},
    tables::{
        ablations, bundles,
        evaluation_runs::{self, EvaluationRun},
        runs,
        runs::Run,
        shards::{self, Shard},
    },
    write::Tx,
};
use faceoff_types::{AblationId, EvaluationId, ProposalId, RunId, ShardId, SubmissionId, TeamId};
use sqlx::SqliteConnection;

/// The evaluation or ablation that a run belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunOwner {
    Evaluation {
        id: EvaluationId,
        /// The proposal that it belongs to, while it does not count.
        proposal: Option<ProposalId>,
    },
    /// The run is one profile of the ablation.
    Ablation(AblationId),
}

impl RunOwner {
    pub(crate) const fn subject(self) -> Subject {
        match self {
            Self::Evaluation { id, proposal: None } => Subject::Evaluation(id),
            Self::Evaluation {
                proposal: Some(proposal),
                ..
            } => Subject::Proposal(proposal),
            Self::Ablation(id) => Subject::Ablation(id),
        }
    }
}

impl EvaluationRun {
    /// The evaluation as the owner of its run.
    pub(crate) const fn owner(self) -> RunOwner {
        RunOwner::Evaluation {
            id: self.id,
            proposal: self.proposal,
        }
    }
}

/// Subjects of a run's progress events. An applied evaluation has those of its proposal, too.
pub(crate) async fn subjects(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Vec<Subject>> {
    let mut subjects = vec![find_owner(connection, run).await?.subject()];
    let proposal = evaluation_runs::proposal_of_run(connection, run).await?;
    subjects.extend(proposal.map(Subject::Proposal));
    subjects.dedup();
    Ok(subjects)
}

pub(crate) async fn find_owner(connection: &mut SqliteConnection, run: RunId) -> Result<RunOwner> {
    if let Some(evaluation) = evaluation_runs::of_run(connection, run).await? {
        return Ok(evaluation.owner());
    }
    ablations::of_run(connection, run)
        .await?
        .map(RunOwner::Ablation)
        .ok_or_else(|| StoreError::Damaged(format!("run {run}: it has no owner")))
}

/// Adds a run, divides it into shards, and queues a job like `job` for each, in an order that is drawn for this run: no
/// agent knows which episodes another team's agent has just played. Their slot time is charged to `team`. [`StoreError::Conflict`] if the bundle of a contestant was removed.
pub(crate) async fn queue_run(
    tx: &mut Tx,
    run: &Run,
    contestants: &[SubmissionId],
    job: NewJob,
    team: TeamId,
) -> Result<()> {
    for contestant in contestants {
        bundles::check_available(tx, *contestant).await?;
    }
    runs::insert(tx, run, contestants).await?;
    let account = queue::open_account(tx, job.lane, &team.to_string()).await?;
    // Each with its random place in the order of play, and its position in the run.
    let mut drawn_shards = Vec::new();
    for task in run.plan.tasks.iter().copied() {
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
            drawn_shards.push((random_number()?, drawn_shards.len(), shard));
            first_episode = end_episode;
        }
    }
    drawn_shards.sort_unstable_by_key(|(place, ..)| *place);
    for (_, position, shard) in drawn_shards {
        let job_id = queue::insert(tx, job, account).await?;
        let position = u32::try_from(position).unwrap_or(u32::MAX);
        shards::insert(tx, run.id, &shard, position, job_id).await?;
    }
    Ok(())
}

/// A random place in the order of play.
fn random_number() -> Result<u64> {
    getrandom::u64()
        .map_err(|error| StoreError::Database(sqlx::Error::Io(std::io::Error::other(error))))
}

/// Drops the open jobs of a run from the queue.
pub(crate) async fn stop(tx: &mut Tx, run: RunId) -> Result<()> {
    let open = shards::open_jobs(tx, run).await?;
    queue::drop_jobs(tx, &open).await?;
    runs::set_stopped(tx, run).await
}

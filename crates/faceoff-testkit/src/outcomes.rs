//! Outcomes of episodes, and their commit.

use faceoff_airhockey::LEFT_TABLE;
use faceoff_store::{Shard, ShardCommit};
use faceoff_types::{
    AgentFault, AgentFaultKind, ComputationTime, EpisodeEnd, EpisodeOutcome, Task, Violations,
};

/// The outcome of an episode that ended by an agent fault, or in success. Steps, times and the end of a success are
/// arbitrary: no test depends on them.
pub fn outcome(task: Task, episode: u32, has_fault: bool) -> EpisodeOutcome {
    let fault = has_fault.then(|| AgentFault {
        fault: AgentFaultKind::NonFinite,
        agent_task: task.into(),
        episode: Some(episode),
        step: Some(3),
        line: Some("{\"type\":\"act\"}".into()),
    });
    EpisodeOutcome {
        task,
        episode,
        steps: 17,
        end: match has_fault {
            true => EpisodeEnd::AGENT_FAULT,
            // The puck left the table, as it does in a goal; a success of some tasks cannot end so.
            false => LEFT_TABLE,
        },
        success: !has_fault,
        violations: Violations::default(),
        computation_time: ComputationTime {
            mean_s: 1e-4,
            max_s: 1e-3,
        },
        fault,
    }
}

/// The outcomes of a shard's episodes, in their order.
pub fn shard_outcomes(
    shard: &Shard,
    mut outcome_fn: impl FnMut(Task, u32) -> EpisodeOutcome,
) -> Vec<EpisodeOutcome> {
    (shard.first_episode..shard.end_episode)
        .map(|episode| outcome_fn(shard.task, episode))
        .collect()
}

/// Commit of a shard with these outcomes that ran to its end and whose agent printed nothing.
pub fn shard_commit(outcomes: Vec<EpisodeOutcome>, recording: Option<String>) -> ShardCommit {
    ShardCommit {
        outcomes,
        log: String::new(),
        stopped_by_faults: false,
        recording,
    }
}

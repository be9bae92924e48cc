//! The purpose of each job of the queue: which row it belongs to, and in which lane it waits. A lane is a share of the
//! queue: lanes with the smallest urgency number are served first, and those of one urgency get equal shares of the slots.

use crate::{
    error::{Result, StoreError},
    queue::{Lane, NewJob},
    tables::{
        evaluation_runs::{self, EvaluationRun},
        games,
        shards::{self, Shard},
        validation_runs,
    },
};
use faceoff_types::{GameId, RunId, SubmissionId};
use sqlx::SqliteConnection;
use uuid::Uuid;

/// Kind of a job. The queue stores its name. Some names are those of earlier versions: `smoke` for a validation run, `finalise` for
/// scoring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JobKind {
    Validation,
    Scoring,
    Shard,
    Game,
}

impl JobKind {
    const ALL: [Self; 4] = [Self::Validation, Self::Scoring, Self::Shard, Self::Game];

    const fn stored_name(self) -> &'static str {
        match self {
            Self::Validation => "smoke",
            Self::Scoring => "finalise",
            Self::Shard => "shard",
            Self::Game => "game",
        }
    }

    const fn in_lane(self, lane: Lane) -> NewJob {
        NewJob {
            kind: self.stored_name(),
            lane,
            batch: 0,
            delay_s: 0,
        }
    }
}

/// A lane with its stored name. Of two equally served lanes, the one with the smaller `tie_breaker` is next.
const fn lane(name: &'static str, urgency: u32, tie_breaker: u32) -> Lane {
    Lane {
        name,
        urgency,
        tie_breaker,
    }
}

// Templates of jobs: what all jobs of one purpose have in common, that is, their kind and their lane.
//
// The lanes are in three levels of urgency. Level 0: scoring, which runs no agent and ends an evaluation. Level 1: validation
// runs, shards and games of rounds share the slots equally, so that none delays the others for long. Level 2: ablations,
// proposals and all other games, which do not count, get the remaining slots. The stored name of a lane may be that of an
// earlier version, too: `free_game` is for test games and friendly games.
pub(crate) const SCORING: NewJob = JobKind::Scoring.in_lane(lane("finalise", 0, 0));
pub(crate) const VALIDATION: NewJob = JobKind::Validation.in_lane(lane("smoke", 1, 0));
pub(crate) const SHARD: NewJob = JobKind::Shard.in_lane(lane("shard", 1, 1));
pub(crate) const ABLATION_SHARD: NewJob = JobKind::Shard.in_lane(lane("ablation", 2, 0));
pub(crate) const ROUND_GAME: NewJob = JobKind::Game.in_lane(lane("game", 1, 2));
pub(crate) const TEST_OR_FRIENDLY_GAME: NewJob = JobKind::Game.in_lane(lane("free_game", 2, 2));
pub(crate) const SCHEDULE_REPLAY_GAME: NewJob = JobKind::Game.in_lane(lane("replay", 2, 3));
pub(crate) const PROPOSAL_SHARD: NewJob = JobKind::Shard.in_lane(lane("proposal", 2, 1));

/// Kinds of jobs that a worker claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobFilter {
    All,
    /// For remote workers. Shards of ablations and proposals, and games that do not count, are included.
    ShardsAndGames,
    /// For the server's own worker, if remote workers run all other jobs.
    ValidationAndScoring,
}

impl JobFilter {
    /// Stored names of the lanes in which these jobs wait, as a JSON array.
    pub(crate) const fn lanes(self) -> &'static str {
        match self {
            Self::All => {
                r#"["finalise","smoke","shard","ablation","proposal","game","free_game","replay"]"#
            }
            Self::ShardsAndGames => {
                r#"["shard","ablation","proposal","game","free_game","replay"]"#
            }
            Self::ValidationAndScoring => r#"["finalise","smoke"]"#,
        }
    }
}

/// Owner of the account of scoring jobs: they belong to no team, and run in the order in which they were queued.
pub(crate) const PLATFORM_ACCOUNT_OWNER: &str = "";

/// The submission, game, shard or evaluation that a job is for.
#[derive(Debug)]
pub(crate) enum JobPurpose {
    Validation(SubmissionId),
    Game(GameId),
    Shard { run: RunId, shard: Shard },
    Scoring(EvaluationRun),
}

/// The purpose of a job, from its stored kind and the row that refers to it.
pub(crate) async fn of_job(
    connection: &mut SqliteConnection,
    job: Uuid,
    stored_kind: &str,
) -> Result<JobPurpose> {
    let purpose = match JobKind::ALL
        .into_iter()
        .find(|kind| kind.stored_name() == stored_kind)
    {
        Some(JobKind::Validation) => validation_runs::of_job(connection, job)
            .await?
            .map(JobPurpose::Validation),
        Some(JobKind::Game) => games::of_job(connection, job).await?.map(JobPurpose::Game),
        Some(JobKind::Shard) => shards::of_job(connection, job)
            .await?
            .map(|(run, shard)| JobPurpose::Shard { run, shard }),
        Some(JobKind::Scoring) => evaluation_runs::of_scoring_job(connection, job)
            .await?
            .map(JobPurpose::Scoring),
        None => None,
    };
    purpose.ok_or_else(|| {
        StoreError::Damaged(format!(
            "job {job}: it is labelled {stored_kind:?}, but no row of that kind refers to it"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn job_filters_cover_each_lane_once() {
        let jobs = [
            SCORING,
            VALIDATION,
            SHARD,
            ABLATION_SHARD,
            PROPOSAL_SHARD,
            ROUND_GAME,
            TEST_OR_FRIENDLY_GAME,
            SCHEDULE_REPLAY_GAME,
        ];
        let lanes = |filter: JobFilter| {
            serde_json::from_str::<Vec<String>>(filter.lanes()).expect("the lanes are JSON")
        };
        let all = lanes(JobFilter::All);
        let remote = lanes(JobFilter::ShardsAndGames);
        let local = lanes(JobFilter::ValidationAndScoring);
        assert_eq!(
            (all.len(), remote.len() + local.len()),
            (jobs.len(), jobs.len())
        );
        for job in jobs {
            let lane = job.lane.name.to_owned();
            assert!(all.contains(&lane), "{lane}");
            let is_remote = matches!(job.kind, "shard" | "game");
            assert_eq!(remote.contains(&lane), is_remote, "{lane}");
            assert_eq!(local.contains(&lane), !is_remote, "{lane}");
        }
    }
}

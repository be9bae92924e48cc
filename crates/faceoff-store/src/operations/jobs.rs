//! Jobs as workers get them, with everything that is needed to run them. A job is a validation run of an upload, a shard
//! (a part of the episodes of a run), a game, or a scoring.

use crate::{
    operations::runs::RunOwner,
    queue::JobClaim,
    tables::{run_plan::RunPlan, runs::Run, shards::Shard, submissions::Submission},
};
use faceoff_types::{
    BundleRef, EvaluationId, GameId, Ruleset, Seed, StageRuntimes, TournamentRules,
};

/// A leased job.
#[derive(Debug, Clone)]
pub struct ClaimedJob {
    /// Proof of the lease.
    pub claim: JobClaim,
    pub job: Job,
}

/// A job with all data that a worker needs to run it.
#[derive(Debug, Clone)]
pub enum Job {
    /// Check that an uploaded bundle starts, answers and keeps time.
    Validation {
        submission: Submission,
        /// Seeds of the validation run's own episodes.
        seeds: RunSeeds,
        /// The ruleset and the plan of an evaluation in the current stage, which the validation run resembles, with the tasks of all
        /// stages that are not closed; `None` if there is no stage.
        ruleset_and_plan: Option<Box<(Ruleset, RunPlan)>>,
        /// Accepted runtimes of each stage that the submission could be evaluated in; it is invalid if none of them
        /// accepts its runtime. Empty if a stage accepts any runtime.
        runtimes: Vec<StageRuntimes>,
    },
    /// Run a shard: a range of a run's episodes.
    Shard {
        owner: RunOwner,
        run: Run,
        shard: Shard,
        bundle: BundleRef,
        /// Seeds of the run's episodes.
        seeds: RunSeeds,
        /// Earlier attempts that ended by a platform fault.
        platform_retries: u32,
    },
    /// Play a game of a tournament.
    Game {
        game: GameId,
        rules: Box<TournamentRules>,
        /// The agents, the home side's first.
        bundles: [BundleRef; 2],
        seeds: RunSeeds,
        /// Number of this attempt, from 1.
        attempt: u32,
        /// Earlier attempts that ended by a platform fault.
        platform_retries: u32,
        /// False for a game of a repeated schedule, of which only the result is stored.
        keeps_recording: bool,
    },
    /// Join the recordings of an evaluation whose shards are all committed, and score it.
    Scoring {
        evaluation: EvaluationId,
        run: Run,
        /// Artifact key prefixes of the shards' recordings, in the order of the episodes.
        recordings: Vec<String>,
        /// Name that the agent gives itself.
        agent_name: String,
        /// Seeds of the run's episodes.
        seeds: RunSeeds,
    },
}

/// Seeds of a job's episodes, derived from the season's secret, which stays in the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunSeeds {
    /// Seed of the episodes: that of a day, an ablation, a validation run or a game.
    pub episodes: Seed,
    /// Seed of the season's model mismatch: the deviation of the simulated robot from the model that teams get.
    pub mismatch: Seed,
}

//! What a slot is told to do.

use crate::{
    operations::runs::RunOwner,
    queue::Claim,
    tables::{runs::Run, shards::Shard, submissions::Submission},
};
use faceoff_types::{
    BundleRef, EvaluationId, GameId, Seed, StageLimits, StageRuntimes, TournamentRules,
};

/// A leased unit of work, with all that a worker must know of it.
#[derive(Debug, Clone)]
pub struct Claimed {
    /// Proof of the lease.
    pub claim: Claim,
    pub work: Work,
}

/// What a worker does under a lease.
#[derive(Debug, Clone)]
pub enum Work {
    /// Check that an uploaded bundle starts, answers and keeps time.
    Smoke {
        submission: Submission,
        /// Of the episodes that it plays, its own.
        seeds: RunSeeds,
        /// What the agent is held to: as in the stage that matters now.
        limits: Box<StageLimits>,
        /// It is refused if none of these takes its runtime: the stages that it could play in; none, if one of them takes
        /// any.
        runtimes: Vec<StageRuntimes>,
    },
    /// Play a range of episodes.
    Shard {
        /// What the run is a part of.
        owner: RunOwner,
        /// What the range is a part of.
        run: Run,
        shard: Shard,
        bundle: BundleRef,
        /// Of the run's episodes.
        seeds: RunSeeds,
        /// How often it was begun before and broken by us.
        platform_retries: u32,
    },
    Game {
        game: GameId,
        rules: Box<TournamentRules>,
        /// The agents, the home side's first.
        bundles: [BundleRef; 2],
        seeds: RunSeeds,
        /// Which attempt this is, from 1.
        attempt: u32,
        /// How often it was begun before and broken by us.
        platform_retries: u32,
        /// Is its recording stored?
        keeps_recording: bool,
    },
    /// Join the recordings of an evaluation whose shards are all committed, and score it, whether it counts or not.
    Finalise {
        evaluation: EvaluationId,
        run: Run,
        /// Artifact key prefixes of the shards' recordings, in order of play.
        recordings: Vec<String>,
        /// The agent's own name.
        agent_name: String,
        /// Of the run's episodes.
        seeds: RunSeeds,
    },
}

/// The seeds of what is played, derived from the season's secret, which stays in the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunSeeds {
    /// Of the episodes: that of the day, of ablations, or of a submission's smoke run.
    pub episodes: Seed,
    /// Of the season's model mismatch.
    pub mismatch: Seed,
}

//! Jobs, and the reports on their results. A *job* is a piece of queued work, such as a range of episodes; a *slot* is a place in a
//! worker process that runs one job at a time, on the server or on another machine.
//!
//! A job carries the seeds of its own episodes, never the season's secret from which they are derived. So a worker learns nothing
//! about the episodes of other days.
//!
//! Fields and variants with `serde(rename)` keep their JSON names of earlier versions, such as `unit` for a job and `smoke` for a
//! validation run: NATS stores messages, so after an upgrade the server and its workers must still read each other's messages.

use crate::game::GameSpec;
use faceoff_types::{
    AgentLimits, BundleRef, EpisodeOutcome, EvaluationId, EvaluationResult, GameId, Magnitudes,
    Millionths, Profile, Ruleset, Seed, StageRuntimes, SubmissionId, Task, TaskWeights, TierBounds,
    ValidationOutcome, Variation,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::{fmt, ops::Range};
use uuid::Uuid;

/// A job that is leased to one slot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobSpec {
    /// The slot's right to run the job, for a limited time.
    pub lease: Lease,
    /// What the slot has to do.
    #[serde(rename = "assignment")]
    pub payload: JobPayload,
}

/// Files of a shard that are stored in addition to the episodes' outcomes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputFiles {
    /// No files.
    #[serde(rename = "nothing")]
    None,
    /// The clips (shortened recordings for replays in the browser), under this key.
    Clips(String),
    /// The complete recording, under this key prefix.
    Recording(String),
}

/// A slot's right to run a job for a limited time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lease {
    /// Id of the job in the queue; the same for each lease of the job.
    #[serde(rename = "unit")]
    pub job_id: Uuid,
    /// Random id of this lease; another lease of the same job has another nonce.
    pub nonce: Uuid,
    /// Name of the lease holder.
    #[serde(rename = "slot")]
    pub holder: String,
    /// The instant at which the lease ends unless it is renewed, by the server's clock.
    pub expires_at: Timestamp,
    /// Duration of the lease, and of each renewal, in seconds. Remote workers use it in place of `expires_at`, since
    /// their clocks may differ.
    pub duration_s: u32,
}

/// The work of a job, by its kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum JobPayload {
    /// Check in a few episodes whether a submitted agent starts, answers and keeps the time limits.
    #[serde(rename = "smoke")]
    Validation {
        /// The submission; used in log messages.
        submission: SubmissionId,
        /// The submitted file, which may not be a valid bundle.
        agent: AgentSpec,
        /// The episodes of the validation run.
        spec: ValidationSpec,
        /// Stages of which at least one must accept the agent's runtime; empty: every runtime is accepted.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        runtimes: Vec<StageRuntimes>,
    },
    /// Play a shard: a range of episodes of one task.
    #[serde(rename = "play")]
    Shard {
        /// Id of the evaluation or ablation (comparison of the perturbations' effects) to which the shard belongs; used in log
        /// messages.
        part_of: Uuid,
        /// An agent with a valid bundle.
        agent: AgentSpec,
        /// The episodes and how to simulate them.
        spec: ShardSpec,
        /// Files to store in addition to the outcomes.
        #[serde(rename = "keeps")]
        output: OutputFiles,
    },
    /// Play a game.
    Game {
        /// Id of the game; used in log messages and for live updates.
        game: GameId,
        /// Number of the attempt, from 1.
        attempt: u32,
        /// Two agents with valid bundles, that of the home side (side 1) first. They may be the same agent.
        agents: Box<[AgentSpec; 2]>,
        /// The rules, length and seeds of the game.
        spec: GameSpec,
        /// Key prefix for the recording; `None`: only the score is stored.
        recording: Option<String>,
    },
    /// Merge the recordings of an evaluation into its dataset and score them.
    #[serde(rename = "finalise")]
    Scoring {
        /// Id of the evaluation; used in log messages.
        evaluation: EvaluationId,
        /// Metadata of the dataset.
        meta: EvaluationMeta,
        /// Key prefixes of the recordings, in order of play.
        recordings: Vec<String>,
        /// Storage key for the dataset.
        dataset: String,
    },
}

/// An agent with its limits. They are the same in a validation run and in an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgentSpec {
    /// The agent's bundle.
    pub bundle: BundleRef,
    /// Limits, enforced by the slot.
    pub limits: AgentLimits,
}

/// Storage key and hashes of a game's files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GameFiles {
    /// Key prefix under which `game.zip`, `side-1.zip` and `side-2.zip` are stored.
    pub key: String,
    /// BLAKE3 of `game.zip`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// BLAKE3 of `side-1.zip` and `side-2.zip`; the home side is side 1.
    pub side_blake3: [String; 2],
}

/// The episodes of a validation run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidationSpec {
    /// The ruleset. Except for the seed, this and all other fields are as in an evaluation, so that an agent cannot distinguish a
    /// validation run from an evaluation.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Magnitudes of perturbations that differ from the ruleset.
    pub perturbations: Magnitudes,
    /// The tasks in the order of play.
    pub tasks: Vec<Task>,
    /// Episodes of each task in an evaluation; at least one.
    pub episodes_per_task: u32,
    /// Episodes of a shard; at least one.
    pub episodes_per_shard: u32,
    /// The submission's own seed.
    pub seed: Seed,
    /// Seed of the season's model mismatch (the simulated robot's deviations from the nominal one), so that the robot is the same as
    /// in counting evaluations.
    pub mismatch_seed: Seed,
}

/// A range of episodes and how to simulate them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardSpec {
    /// The ruleset; absent in recordings of the first ruleset.
    #[serde(default = "legacy_ruleset")]
    pub ruleset: Ruleset,
    /// The task.
    pub task: Task,
    /// The episodes, by their numbers among those of the task in the run, from 0.
    pub episodes: Range<u32>,
    /// The perturbation profile: a named set of disturbances of the simulation.
    pub profile: Profile,
    /// The evaluation's seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch: how the simulated robot deviates from the nominal one that agents know.
    pub mismatch_seed: Seed,
    /// Agent faults allowed; one more ends the shard early.
    pub max_faults: u32,
    /// Number of earlier attempts that a platform fault (a failure that is not the agent's) ended.
    #[serde(default)]
    pub platform_retries: u32,
    /// Magnitudes of the profile's perturbations; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
}

/// Metadata of an evaluation's dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluationMeta {
    /// The perturbation profile.
    pub profile: Profile,
    /// The evaluation's seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch.
    pub mismatch_seed: Seed,
    /// The agent's name.
    pub agent: String,
    /// The ruleset of the evaluation.
    pub ruleset: Ruleset,
    /// Organisers' deviations from the ruleset, in perturbations and in scoring.
    #[serde(flatten)]
    pub variation: Variation,
    /// Weights of the tasks under these rules, in the order of the competition.
    pub task_weights: TaskWeights,
    /// The bounds of the competition's tiers, unless the variation has others; null: it has no tiers. Absent in jobs of earlier
    /// versions.
    #[serde(default = "legacy_tiers")]
    pub tiers: Option<TierBounds>,
}

impl EvaluationMeta {
    /// The bounds of the tiers under these rules; `None` if the competition has no tiers.
    #[must_use]
    pub fn tier_bounds(&self) -> Option<TierBounds> {
        let own = self.tiers?;
        Some(self.variation.tier_bounds.unwrap_or(own))
    }
}

/// The tier bounds of jobs of earlier versions, which had one competition only.
#[expect(clippy::unnecessary_wraps, reason = "the type of the field")]
const fn legacy_tiers() -> Option<TierBounds> {
    Some(TierBounds::constant(
        Millionths::new(500_000),
        Millionths::new(1_500_000),
    ))
}

const fn legacy_ruleset() -> Ruleset {
    Ruleset::new("airhockey-2023.1")
}

/// The result of a completed job. After a platform fault there is no report: the job goes back to the queue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum JobReport {
    /// The result of a [`JobPayload::Validation`].
    #[serde(rename = "smoke")]
    Validation(ValidationOutcome),
    /// The result of a [`JobPayload::Shard`].
    #[serde(rename = "play")]
    Shard {
        /// One outcome per episode, in order; fewer if faults ended the shard.
        outcomes: Vec<EpisodeOutcome>,
        /// The stored part of the agent's standard error (beginning and end), with its faults.
        log: String,
        /// Did the agent exceed the allowed faults, so that the remaining episodes were not played?
        stopped_by_faults: bool,
        /// Key prefix of the recording, if it was stored.
        recording: Option<String>,
    },
    /// The result of a [`JobPayload::Game`].
    Game {
        /// The score: the content of the game's `results.json`.
        score: Value,
        /// The game's files, if they were stored.
        recording: Option<GameFiles>,
        /// The stored parts of both agents' standard errors with their faults, the home side's first.
        logs: [String; 2],
    },
    /// The result of a [`JobPayload::Scoring`].
    #[serde(rename = "finalise")]
    Scoring {
        /// Storage key of the dataset.
        dataset: String,
        /// BLAKE3 of the dataset archive, 64 hexadecimal digits.
        blake3: String,
        /// The score: the content of `results.json`.
        result: Box<EvaluationResult>,
    },
}

impl JobReport {
    /// Number of episodes played; 0 for other kinds of jobs.
    #[must_use]
    pub fn episodes(&self) -> u32 {
        match self {
            Self::Shard { outcomes, .. } => u32::try_from(outcomes.len()).unwrap_or(u32::MAX),
            Self::Validation(_) | Self::Game { .. } | Self::Scoring { .. } => 0,
        }
    }
}

/// The description used in log messages.
impl fmt::Display for JobPayload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Validation { submission, .. } => {
                write!(f, "validation run of submission {submission}")
            }
            Self::Shard { part_of, spec, .. } => write!(
                f,
                "{} episodes {} to {} of {part_of}, profile {}",
                spec.task,
                spec.episodes.start,
                spec.episodes.end.saturating_sub(1),
                spec.profile
            ),
            Self::Game {
                game,
                attempt,
                spec,
                ..
            } => write!(
                f,
                "game {game}, {} steps, profile {}, attempt {attempt}",
                spec.steps, spec.profile
            ),
            Self::Scoring { evaluation, .. } => {
                write!(f, "scoring of evaluation {evaluation}")
            }
        }
    }
}

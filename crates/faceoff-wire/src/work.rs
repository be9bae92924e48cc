//! Work orders: all that a slot needs to know, on whichever machine it is, and what it reports back.
//!
//! An order carries the seeds of the episodes that it asks for, never the secret that they are
//! derived from: whoever carries it out learns nothing of another day.

use crate::game::GameSpec;
use faceoff_types::{
    AgentLimits, BundleRef, EpisodeOutcome, EvaluationId, EvaluationResult, GameId,
    PerturbationSettings, Profile, Ruleset, Seed, SmokeOutcome, StageRuntimes, SubmissionId, Task,
    Variation,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::{fmt, ops::Range};
use uuid::Uuid;

/// A unit of work, leased to one slot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorkOrder {
    /// Until when it is this slot's alone.
    pub lease: Lease,
    /// What is to be done.
    pub assignment: Assignment,
}

/// What is kept of played episodes beside their outcomes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Keeps {
    /// Nothing.
    Nothing,
    /// What replays are drawn from, below this key.
    Clips(String),
    /// All of the recording, below this key prefix.
    Recording(String),
}

/// Proof that a unit of work is a slot's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lease {
    /// The queue's name for the work; the same when it is leased again.
    pub unit: Uuid,
    /// Drawn for this lease alone.
    pub nonce: Uuid,
    /// Whose it is.
    pub slot: String,
    /// When it ends unless renewed, by the server's clock.
    pub expires_at: Timestamp,
    /// For how long it was given and each renewal extends it, seconds: another machine's clock may
    /// tell another time.
    pub duration_s: u32,
}

/// What a slot is to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Assignment {
    /// Find out whether an uploaded agent starts, answers and keeps time.
    Smoke {
        /// For the log of whoever does it.
        submission: SubmissionId,
        /// Not known to be a bundle at all.
        agent: AgentOrder,
        /// What it is to play.
        spec: SmokeSpec,
        /// It is refused if none of these stages takes its runtime; none: any is taken.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        runtimes: Vec<StageRuntimes>,
    },
    /// Play a range of episodes.
    Play {
        /// The evaluation or ablation; for the log.
        part_of: Uuid,
        /// It has passed its smoke run.
        agent: AgentOrder,
        /// Which episodes.
        spec: ShardSpec,
        /// What is kept beside the outcomes.
        keeps: Keeps,
    },
    /// Play a game.
    Game {
        /// Which; for the log, and for who watches it.
        game: GameId,
        /// Which attempt at it this is, from 1.
        attempt: u32,
        /// The home side's first; both have passed their smoke runs. They may be the same.
        agents: Box<[AgentOrder; 2]>,
        /// By which rules, and with which seeds.
        spec: GameSpec,
        /// Key prefix for the recording; `None`: the score alone is kept.
        recording: Option<String>,
    },
    /// Join an evaluation's recordings into its dataset and score them.
    Finalise {
        /// For the log.
        evaluation: EvaluationId,
        /// What the dataset says about itself.
        meta: EvaluationMeta,
        /// Key prefixes of the recordings, in order of play.
        recordings: Vec<String>,
        /// Key for the dataset.
        dataset: String,
    },
}

/// An agent, and what it is held to. A smoke run and the real one differ in nothing of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgentOrder {
    /// Its archive.
    pub bundle: BundleRef,
    /// Enforced by whoever carries out the order.
    pub limits: AgentLimits,
}

/// Where the files of a game are, and what they hash to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredGame {
    /// Key prefix under which `game.zip`, `side-1.zip` and `side-2.zip` are stored.
    pub key: String,
    /// BLAKE3 of `game.zip`, 64 hexadecimal digits.
    pub game_blake3: String,
    /// Of the sides' own files, the home side's first.
    pub side_blake3: [String; 2],
}

/// What decides which episodes a smoke run plays, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SmokeSpec {
    /// Drawn for the submission alone.
    pub seed: Seed,
    /// The seed of the season's model mismatch: by its robot, too, the run is like those that count.
    pub mismatch_seed: Seed,
}

/// Which episodes to simulate, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardSpec {
    /// By which rules; recordings of the first do not say.
    #[serde(default = "first_ruleset")]
    pub ruleset: Ruleset,
    /// The task.
    pub task: Task,
    /// The episodes, by their index within the evaluation.
    pub episodes: Range<u32>,
    /// The perturbation profile.
    pub profile: Profile,
    /// The evaluation's seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch.
    pub mismatch_seed: Seed,
    /// More faults than this end the shard early.
    pub max_faults: u32,
    /// How often these episodes were begun before and broken by us.
    #[serde(default)]
    pub platform_retries: u32,
    /// Magnitudes of what the profile switches on; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "is_the_rulesets")]
    pub perturbations: Box<PerturbationSettings>,
}

/// What the dataset of an evaluation says about itself.
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
    /// The rules it was played by.
    pub ruleset: Ruleset,
    /// What it was played by and is scored by otherwise than the ruleset has it.
    #[serde(flatten)]
    pub variation: Variation,
}

fn is_the_rulesets(perturbations: &PerturbationSettings) -> bool {
    *perturbations == PerturbationSettings::default()
}

const fn first_ruleset() -> Ruleset {
    Ruleset::First
}

/// What came of an order. Faults of ours are not in it: those give the unit back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WorkReport {
    /// Of [`Assignment::Smoke`].
    Smoke(SmokeOutcome),
    /// Of [`Assignment::Play`].
    Play {
        /// One per episode, in order; fewer if faults stopped the shard.
        outcomes: Vec<EpisodeOutcome>,
        /// The end of the agent's standard error, with its faults.
        log: String,
        /// More faults than allowed: the remaining episodes were not played.
        stopped_by_faults: bool,
        /// Key prefix under which the recording is stored, if it is kept.
        recording: Option<String>,
    },
    /// Of [`Assignment::Game`].
    Game {
        /// The scoring's: a game's `results.json`.
        score: Value,
        /// Its files, if they are kept.
        recording: Option<StoredGame>,
        /// The ends of both agents' standard errors with their faults, the home side's first.
        logs: [String; 2],
    },
    /// Of [`Assignment::Finalise`].
    Finalise {
        /// Key under which the dataset is stored.
        dataset: String,
        /// BLAKE3 of the archive, 64 hexadecimal digits.
        blake3: String,
        /// The score.
        result: Box<EvaluationResult>,
    },
}

impl WorkReport {
    /// How many episodes were played.
    #[must_use]
    pub fn episodes(&self) -> u32 {
        match self {
            Self::Play { outcomes, .. } => u32::try_from(outcomes.len()).unwrap_or(u32::MAX),
            Self::Smoke(_) | Self::Game { .. } | Self::Finalise { .. } => 0,
        }
    }
}

/// As a log line names it.
impl fmt::Display for Assignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Smoke { submission, .. } => write!(f, "smoke run of submission {submission}"),
            Self::Play { part_of, spec, .. } => write!(
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
            Self::Finalise { evaluation, .. } => {
                write!(f, "finalisation of evaluation {evaluation}")
            }
        }
    }
}

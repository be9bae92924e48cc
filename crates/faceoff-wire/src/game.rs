//! The specification of a game between two agents, the *sides*, and the JSON files of its recording.
//!
//! A recording is a zip archive with `manifest.json`, `results.json`, `outcome.json`, `calibration.json`,
//! `motion.parquet`, `rallies.parquet` and, for each side N, `side-N.parquet` (its steps), `entries-N.parquet` (how it
//! got ready for each rally) and `agent-N.log`. A side's own archive is derived from it: the public files and those of that side,
//! without seeds.

use crate::dataset::{FileDigest, SimulatorId};
use faceoff_types::{ForfeitScore, GameLimits, Magnitudes, Profile, Ruleset, Seed, SlotTiming};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name and version of the layout of a game's recording.
pub const GAME_SCHEMA: &str = "faceoff-game/1";
/// Name and version of the layout of a side's own archive.
pub const GAME_SIDE_SCHEMA: &str = "faceoff-game-side/1";

/// The specification of a game. It does not contain the agents' resource limits (memory, processes), which are part of the job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameSpec {
    /// The ruleset.
    pub ruleset: Ruleset,
    /// Control steps of the whole game.
    pub steps: u32,
    /// The perturbation profile: a named set of disturbances of the simulation.
    pub profile: Profile,
    /// The game's own seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch: how the simulated robots deviate from the nominal one that agents know.
    pub mismatch_seed: Seed,
    /// Limits of each side on time and faults.
    #[serde(default)]
    pub limits: GameLimits,
    /// What the game counts after a forfeit; absent: 10 : 0.
    #[serde(default, skip_serializing_if = "ForfeitScore::is_legacy")]
    pub forfeit_score: ForfeitScore,
    /// Number of earlier attempts that a platform fault (a failure that is not the agents') ended.
    #[serde(default)]
    pub platform_retries: u32,
    /// Magnitudes of the profile's perturbations; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
}

/// `manifest.json` of a game: a description of the game, with the hashes of its files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameManifest {
    /// [`GAME_SCHEMA`].
    pub schema: String,
    /// The simulator that computed the states; only the same one reproduces them.
    pub simulator: SimulatorId,
    /// The specification of the game.
    #[serde(flatten)]
    pub spec: GameSpec,
    /// The agents' names, the first side's first.
    pub agents: [String; 2],
    /// Size and hash of every other file of the archive, by name.
    pub files: BTreeMap<String, FileDigest>,
}

/// `manifest.json` of a side's own archive. It contains no seed, since a seed would allow to reproduce the other side's
/// observations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameSideManifest {
    /// [`GAME_SIDE_SCHEMA`].
    pub schema: String,
    /// The ruleset of the game.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// The side, 1 or 2.
    pub side: faceoff_types::Side,
    /// The agents' names, the first side's first.
    pub agents: [String; 2],
    /// Size and hash of every other file of the archive, by name.
    pub files: BTreeMap<String, FileDigest>,
}

/// `calibration.json` of a game: timing quality of the slot for each side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GameCalibration {
    /// One entry per side, the first side's first.
    pub sides: [SlotTiming; 2],
}

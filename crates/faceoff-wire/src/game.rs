//! Games: what a slot is told to play, and what a recording of one says about itself.
//!
//! A recording is a zip archive with `manifest.json`, `results.json`, `outcome.json`, `calibration.json`,
//! `motion.parquet`, `rallies.parquet` and, for each side N, `side-N.parquet`, `entries-N.parquet` and
//! `agent-N.log`. A side's own file is made of it: the public files and those of that side, without seeds.

use crate::dataset::{FileDigest, SimulatorId};
use faceoff_types::{GameLimits, PerturbationSettings, Profile, Ruleset, Seed, SlotTiming};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name and version of the layout of a game's recording.
pub const GAME_SCHEMA: &str = "faceoff-game/1";
/// Name and version of the layout of a side's own file.
pub const GAME_SIDE_SCHEMA: &str = "faceoff-game-side/1";

/// Which game to play, and how. Both agents' limits and CPUs are not in it: those are the host's and the
/// order's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameSpec {
    /// By which rules.
    pub ruleset: Ruleset,
    /// Control steps of the whole game.
    pub steps: u32,
    /// The perturbation profile.
    pub profile: Profile,
    /// The game's own seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch.
    pub mismatch_seed: Seed,
    /// What each side is held to.
    #[serde(default)]
    pub limits: GameLimits,
    /// How often this game was begun before and broken by us.
    #[serde(default)]
    pub platform_retries: u32,
    /// Magnitudes of what the profile switches on; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "is_the_rulesets")]
    pub perturbations: Box<PerturbationSettings>,
}

/// `manifest.json` of a game: what it is and what its files must hash to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameManifest {
    /// [`GAME_SCHEMA`].
    pub schema: String,
    /// The simulator that made the states; only the same one can make them again.
    pub simulator: SimulatorId,
    /// What was to be played.
    #[serde(flatten)]
    pub spec: GameSpec,
    /// The agents' names, the first side's first.
    pub agents: [String; 2],
    /// Every other file of the archive.
    pub files: BTreeMap<String, FileDigest>,
}

/// `manifest.json` of a side's own file. It names no seed: with one, the other side's observations could be
/// made again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameSideManifest {
    /// [`GAME_SIDE_SCHEMA`].
    pub schema: String,
    /// The rules it was played by.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Which side it is of: 1 or 2.
    pub side: faceoff_types::Side,
    /// The agents' names, the first side's first.
    pub agents: [String; 2],
    /// Every other file of the archive.
    pub files: BTreeMap<String, FileDigest>,
}

/// `calibration.json` of a game: how evenly the slot kept time for each side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GameCalibration {
    /// The first side's first.
    pub sides: [SlotTiming; 2],
}

fn is_the_rulesets(perturbations: &PerturbationSettings) -> bool {
    *perturbations == PerturbationSettings::default()
}

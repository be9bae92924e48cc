//! Settings shared by all games of an environment.

use crate::{
    actions::{ActionFormat, ActionMode},
    setup::{check_magnitudes, read_json},
};
use faceoff_sim::{
    ActivePerturbations, GameSetup, Interpolation, Perturbation, PerturbationSettings, Plant,
};
use faceoff_types::Seed;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// Settings of games, written by the Python half in JSON. In pairs robot 1 comes first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GameSettings {
    interpolation: [Interpolation; 2],
    action_mode: [ActionMode; 2],
    clip_actions: bool,
    // The earlier name, which pickled games contain.
    #[serde(rename = "factors")]
    active_perturbations: Vec<Perturbation>,
    perturbations: PerturbationSettings,
    /// Seed of the arms' deviation from their model; `None` derives it from the seed of each game.
    mismatch_seed: Option<Seed>,
    /// Control steps after which a game is over.
    pub max_steps: u32,
    /// Whether a game is over when a robot makes the world diverge. Otherwise the caller stops commanding that robot.
    pub ends_at_divergence: bool,
}

impl GameSettings {
    /// Parses settings. The Python half has checked all but the magnitudes.
    ///
    /// # Errors
    /// If they are invalid.
    pub fn read(json: &str) -> PyResult<Self> {
        let settings: Self = read_json(json)?;
        check_magnitudes(&settings.active_perturbations, &settings.perturbations)?;
        Ok(settings)
    }

    /// The formats of both robots' actions.
    pub fn action_formats(&self) -> [ActionFormat; 2] {
        [0, 1].map(|robot| ActionFormat {
            mode: self.action_mode[robot],
            interpolation: self.interpolation[robot],
            clip: self.clip_actions,
        })
    }

    /// Whether games with the seeds `seed` and `other` have the same arms.
    pub fn shares_plant(&self, seed: u64, other: u64) -> bool {
        seed == other || self.mismatch_seed.is_some()
    }

    /// The arms of games with this seed. It takes milliseconds to draw them.
    pub fn plant(&self, seed: u64) -> Plant {
        let seed = Seed::from_number(seed).model_mismatch();
        let mismatch_seed = self.mismatch_seed.unwrap_or(seed);
        Plant::for_perturbations(self.active_set(), &self.perturbations, mismatch_seed)
    }

    /// The simulator's setup of game `number` of a seed; number 0 is the game of `faceoff play`.
    pub fn game_setup(&self, plant: &Plant, seed: u64, number: u32) -> GameSetup {
        let root = Seed::from_number(seed);
        GameSetup {
            interpolation: self.interpolation,
            active_perturbations: self.active_set(),
            settings: self.perturbations.clone(),
            plant: plant.clone(),
            seed: match number {
                0 => root,
                _ => root.derive("game", &number.to_le_bytes()),
            },
        }
    }

    fn active_set(&self) -> ActivePerturbations {
        self.active_perturbations
            .iter()
            .fold(ActivePerturbations::NONE, |set, perturbation| {
                set.with(*perturbation)
            })
    }
}

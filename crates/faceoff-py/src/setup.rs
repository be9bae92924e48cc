//! What all worlds of an environment share.

use crate::{
    actions::{ActionMode, Actions},
    errors::argument,
};
use faceoff_sim::{Episode, Plant};
use faceoff_types::{
    EPISODE_STEPS, Factor, Factors, Interpolation, PerturbationSettings, Seed, Task,
};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// What is played and how, as Python's half states it in JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// The task.
    pub task: Task,
    /// How actions become trajectories.
    pub interpolation: Interpolation,
    /// What an action's numbers mean.
    pub action_mode: ActionMode,
    /// Bring numbers that are too large to their bounds, instead of refusing them.
    pub clip_actions: bool,
    /// Perturbations.
    pub factors: Vec<Factor>,
    /// Their magnitudes.
    pub perturbations: PerturbationSettings,
    /// The season's plant; `None` draws each world's from its own seed.
    pub mismatch_seed: Option<Seed>,
    /// Control steps after which an episode is cut off.
    pub max_episode_steps: u32,
}

impl Setup {
    /// Reads what Python's half has checked already, but for magnitudes.
    ///
    /// # Errors
    /// If it is none.
    pub fn read(json: &str) -> PyResult<Self> {
        let setup: Self = serde_json::from_str(json)
            .map_err(|error| argument("setup", "what the environments write", error))?;
        if !(1..=EPISODE_STEPS).contains(&setup.max_episode_steps) {
            return Err(argument(
                "max_episode_steps",
                format!("1 to {EPISODE_STEPS}"),
                setup.max_episode_steps,
            ));
        }
        setup
            .perturbations
            .check()
            .map_err(|error| argument("perturbations", "magnitudes that a world has", error))?;
        let magnitudes = &setup.perturbations;
        let is_drawn = setup.factors.contains(&Factor::ModelMismatch);
        // Thousands of draws in vain would look like a hang.
        if is_drawn
            && magnitudes.model_mismatch != PerturbationSettings::default().model_mismatch
            && !Plant::can_be_drawn(magnitudes, Seed::from_number(0))
        {
            return Err(argument(
                "perturbations",
                "magnitudes of model_mismatch under which a plant has such a static error",
                "some under which none was found",
            ));
        }
        Ok(setup)
    }

    /// The factors as a set.
    pub fn factor_set(&self) -> Factors {
        self.factors
            .iter()
            .fold(Factors::NONE, |set, factor| set.with(*factor))
    }

    /// How this setup's actions are read.
    pub fn actions(&self) -> Actions {
        Actions {
            mode: self.action_mode,
            interpolation: self.interpolation,
            clip: self.clip_actions,
        }
    }

    /// Numbers in an observation.
    pub fn observation_len(&self) -> usize {
        faceoff_sim::channel::observation::len(self.task)
    }

    /// The plant of a world whose seed this is.
    pub fn plant(&self, seed: Seed) -> Plant {
        let season = self.mismatch_seed.unwrap_or_else(|| seed.model_mismatch());
        Plant::under(self.factor_set(), &self.perturbations, season)
    }

    /// An episode at its start.
    pub fn episode(
        &self,
        plant: &Plant,
        seed: Seed,
        number: u32,
        puck: Option<[f64; 6]>,
    ) -> Episode {
        let (factors, settings) = (self.factor_set(), &self.perturbations);
        let (task, interpolation) = (self.task, self.interpolation);
        let seed = seed.episode(task, number);
        match puck {
            None => Episode::new(task, interpolation, factors, settings, plant, seed),
            Some(puck) => {
                Episode::starting_with(task, interpolation, factors, settings, plant, seed, puck)
            }
        }
    }
}

//! Setup shared by all worlds of an environment.
//!
//! A *perturbation* is one kind of difference from the ideal simulator. A *plant* is a simulated arm; with the perturbation
//! `model_mismatch` its masses, gains and friction deviate from the model, by random numbers from a seed.

use crate::{
    actions::{ActionFormat, ActionMode},
    errors::{argument_error, check_perturbations},
};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Episode, Interpolation, Perturbation, PerturbationSettings, Plant,
};
use faceoff_types::{EPISODE_STEPS, Seed};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

/// Setup of an environment, written by the Python half in JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// The task of all episodes.
    pub task: AirHockeyTask,
    /// Conversion of actions to trajectories.
    pub interpolation: Interpolation,
    /// Meaning of an action's numbers.
    pub action_mode: ActionMode,
    /// Clip numbers to their bounds instead of refusing them.
    pub clip_actions: bool,
    /// The active perturbations. In JSON, which pickled states contain, they have their earlier name.
    #[serde(rename = "factors")]
    pub active_perturbations: Vec<Perturbation>,
    /// Magnitudes of the perturbations.
    pub perturbations: PerturbationSettings,
    /// Seed of the plant; `None` draws the plant of each world from the world's seed.
    pub mismatch_seed: Option<Seed>,
    /// Control steps after which an episode is truncated.
    pub max_episode_steps: u32,
}

impl Setup {
    /// Parses a setup. The Python half has checked all but the magnitudes.
    ///
    /// # Errors
    /// If the setup is invalid.
    pub fn read(json: &str) -> PyResult<Self> {
        let setup: Self = read_json(json)?;
        if !(1..=EPISODE_STEPS).contains(&setup.max_episode_steps) {
            return Err(argument_error(
                "max_episode_steps",
                format!("1 to {EPISODE_STEPS}"),
                setup.max_episode_steps,
            ));
        }
        check_magnitudes(&setup.active_perturbations, &setup.perturbations)?;
        Ok(setup)
    }

    /// The active perturbations as a set.
    pub fn active_set(&self) -> ActivePerturbations {
        self.active_perturbations
            .iter()
            .fold(ActivePerturbations::NONE, |set, perturbation| {
                set.with(*perturbation)
            })
    }

    /// The format of this setup's actions.
    pub fn action_format(&self) -> ActionFormat {
        ActionFormat {
            mode: self.action_mode,
            interpolation: self.interpolation,
            clip: self.clip_actions,
        }
    }

    /// Count of numbers in an observation.
    pub fn observation_len(&self) -> usize {
        faceoff_sim::channel::observation::len(self.task)
    }

    /// The plant of a world with this seed.
    pub fn plant(&self, seed: Seed) -> Plant {
        let mismatch_seed = self.mismatch_seed.unwrap_or_else(|| seed.model_mismatch());
        Plant::for_perturbations(self.active_set(), &self.perturbations, mismatch_seed)
    }

    /// A new episode; `puck` replaces its initial state of the puck.
    pub fn episode(
        &self,
        plant: &Plant,
        seed: Seed,
        number: u32,
        puck: Option<[f64; 6]>,
    ) -> Episode {
        let (active_perturbations, settings) = (self.active_set(), &self.perturbations);
        let (task, interpolation) = (self.task, self.interpolation);
        let seed = seed.episode(task, number);
        match puck {
            None => Episode::new(
                task,
                interpolation,
                active_perturbations,
                settings,
                plant,
                seed,
            ),
            Some(puck) => Episode::with_initial_puck(
                task,
                interpolation,
                active_perturbations,
                settings,
                plant,
                seed,
                puck,
            ),
        }
    }
}

/// Parses what the Python half has written. It has checked all but the magnitudes of perturbations.
///
/// # Errors
/// If it is invalid.
pub fn read_json<T: DeserializeOwned>(json: &str) -> PyResult<T> {
    let setup_error = |error| argument_error("setup", "a setup in JSON", error);
    let setup: Value = serde_json::from_str(json).map_err(setup_error)?;
    if let Some(magnitudes) = setup.get("perturbations") {
        PerturbationSettings::deserialize(magnitudes).map_err(|error| {
            argument_error(
                "perturbations",
                "magnitudes of perturbations by their names",
                error,
            )
        })?;
    }
    serde_json::from_value(setup).map_err(setup_error)
}

/// Refuses magnitudes that are out of range, or for which no plant is found.
///
/// # Errors
/// If they are invalid.
pub fn check_magnitudes(
    active_perturbations: &[Perturbation],
    magnitudes: &PerturbationSettings,
) -> PyResult<()> {
    check_perturbations(magnitudes)?;
    // Thousands of unsuccessful draws would look like a hang.
    if active_perturbations.contains(&Perturbation::ModelMismatch)
        && magnitudes.model_mismatch != PerturbationSettings::default().model_mismatch
        && !Plant::can_be_drawn(magnitudes, Seed::from_number(0))
    {
        return Err(argument_error(
            "perturbations",
            "magnitudes of model_mismatch that allow a plant with this static error",
            "magnitudes for which no plant was found",
        ));
    }
    Ok(())
}

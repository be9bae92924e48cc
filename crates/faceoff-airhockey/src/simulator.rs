//! The simulator of air hockey, for workers and for verification.

use crate::SimulationSetup;
use crate::{
    competition,
    hello_env::hello_env,
    magnitudes::{check_plant_can_be_drawn, perturbation_settings},
};
use faceoff_episode::{Conditions, InvalidConditions, Simulator, WorldFactory};
use faceoff_sim::{AirHockeyRuleset, PerturbationSettings};
use faceoff_types::{AgentTask, Competition, InvalidMagnitude, Magnitudes, Seed, UnknownTask};
use std::sync::{Arc, LazyLock};

static SIMULATOR: LazyLock<Arc<AirHockey>> = LazyLock::new(|| {
    Arc::new(AirHockey {
        competition: Arc::new(competition()),
    })
});

/// The simulator with its competition, which is made once.
#[must_use]
pub fn simulator() -> Arc<AirHockey> {
    SIMULATOR.clone()
}

/// The simulator of the Robot Air Hockey Challenge, with the description of the competition.
#[derive(Debug)]
pub struct AirHockey {
    competition: Arc<Competition>,
}

impl AirHockey {
    /// The simulator of a competition with a changed description, such as other tiers.
    #[must_use]
    pub fn with_competition(competition: Competition) -> Self {
        Self {
            competition: Arc::new(competition),
        }
    }

    /// The description of the competition: tasks, profiles, tiers.
    #[must_use]
    pub const fn competition(&self) -> &Arc<Competition> {
        &self.competition
    }
}

impl Simulator for AirHockey {
    fn competition(&self) -> &Arc<Competition> {
        &self.competition
    }

    fn fingerprint(&self) -> &str {
        faceoff_sim::simulator_fingerprint()
    }

    fn hello_env(&self, agent_task: AgentTask) -> Result<String, UnknownTask> {
        let env = hello_env(agent_task)?;
        Ok(serde_json::to_string(&env).expect("writing plain data to memory cannot fail"))
    }

    fn world_factory(
        &self,
        conditions: &Conditions<'_>,
    ) -> Result<Box<dyn WorldFactory>, InvalidConditions> {
        Ok(Box::new(simulation_setup(conditions)?))
    }

    fn check_season_magnitudes(
        &self,
        magnitudes: &Magnitudes,
        mismatch_seed: Seed,
    ) -> Result<(), String> {
        check_plant_can_be_drawn(magnitudes, mismatch_seed)
    }
}

/// The setup of the simulations of an evaluation or of a game.
///
/// # Errors
/// If the simulator has no such ruleset, profile or magnitudes.
pub fn simulation_setup(conditions: &Conditions<'_>) -> Result<SimulationSetup, InvalidConditions> {
    let Conditions {
        ruleset,
        profile,
        perturbations,
        seed,
        mismatch_seed,
    } = *conditions;
    Ok(SimulationSetup::with_ruleset(
        AirHockeyRuleset::find(ruleset).ok_or(InvalidConditions::Ruleset(ruleset))?,
        profile.try_into().map_err(InvalidConditions::Profile)?,
        &perturbation_settings(perturbations).map_err(InvalidConditions::Magnitudes)?,
        seed,
        mismatch_seed,
    ))
}

/// Checks settings of the simulator and converts them to [`Magnitudes`].
///
/// # Errors
/// The first magnitude that is out of range, or not a number.
pub fn checked_magnitudes(settings: &PerturbationSettings) -> Result<Magnitudes, InvalidMagnitude> {
    let parsed = serde_json::to_value(settings).and_then(serde_json::from_value);
    let mut magnitudes: Magnitudes = parsed.map_err(|error| InvalidMagnitude::Value {
        field: "perturbations".to_owned(),
        expected: "numbers".to_owned(),
        got: error.to_string(),
    })?;
    SIMULATOR.competition.check_magnitudes(&mut magnitudes)?;
    Ok(magnitudes)
}

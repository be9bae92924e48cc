//! The simulator of air hockey, as slots and verification use it.

use crate::Arena;
use crate::{
    competition,
    env::env,
    magnitudes::{check_robot, settings},
};
use faceoff_episode::{Conditions, Environment, InvalidConditions, Simulator};
use faceoff_sim::AirHockeyRuleset;
use faceoff_types::{AgentTask, Competition, Magnitudes, Ruleset, Seed, UnknownTask};
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

/// The Robot Air Hockey Challenge.
#[derive(Debug)]
pub struct AirHockey {
    competition: Arc<Competition>,
}

impl AirHockey {
    /// With a changed description, such as other tiers.
    #[must_use]
    pub fn with_competition(competition: Competition) -> Self {
        Self {
            competition: Arc::new(competition),
        }
    }

    /// Its description.
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
        faceoff_sim::fingerprint()
    }

    fn env(&self, agent_task: AgentTask) -> Result<String, UnknownTask> {
        let env = env(agent_task)?;
        Ok(serde_json::to_string(&env).expect("writing plain data to memory cannot fail"))
    }

    fn environment(
        &self,
        conditions: &Conditions<'_>,
    ) -> Result<Box<dyn Environment>, InvalidConditions> {
        let Conditions {
            ruleset,
            profile,
            perturbations,
            seed,
            mismatch_seed,
        } = *conditions;
        Ok(Box::new(Arena::with_ruleset(
            find_ruleset(ruleset)?,
            profile.try_into().map_err(InvalidConditions::Profile)?,
            &settings(perturbations).map_err(InvalidConditions::Magnitudes)?,
            seed,
            mismatch_seed,
        )))
    }

    fn check_magnitudes(&self, magnitudes: &Magnitudes, mismatch_seed: Seed) -> Result<(), String> {
        check_robot(magnitudes, mismatch_seed)
    }
}

/// The simulator's ruleset of this name.
///
/// # Errors
/// If the simulator has no such ruleset.
pub fn find_ruleset(ruleset: Ruleset) -> Result<AirHockeyRuleset, InvalidConditions> {
    AirHockeyRuleset::find(ruleset).ok_or(InvalidConditions::Ruleset(ruleset))
}

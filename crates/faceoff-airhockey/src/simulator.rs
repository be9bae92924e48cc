//! The simulator of air hockey, as slots and verification use it.

use crate::Arena;
use crate::{competition, env::env};
use faceoff_episode::{Conditions, Environment, Simulator};
use faceoff_types::{AgentTask, Competition, UnknownProfile, UnknownTask};
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
    ) -> Result<Box<dyn Environment>, UnknownProfile> {
        let Conditions {
            ruleset,
            profile,
            perturbations,
            seed,
            mismatch_seed,
        } = *conditions;
        Ok(Box::new(Arena::with_ruleset(
            ruleset,
            profile.try_into()?,
            perturbations,
            seed,
            mismatch_seed,
        )))
    }
}

//! The setup of simulations: the settings that all episodes of an evaluation, or all rallies of a game, have in common.

use faceoff_sim::{
    ActivePerturbations, AirHockeyProfile, AirHockeyRuleset, AirHockeyTask, Bounds, Episode, Game,
    GameSetup, Interpolation, PerturbationSettings, Plant,
};
use faceoff_types::{Seed, Task};

/// Creates the simulations of episodes and games. It has rules, perturbations, the season's plant (the true robot, which deviates from the
/// nominal one that agents know) and the seed from which the seeds of episodes and rallies are derived.
#[derive(Debug, Clone)]
pub struct SimulationSetup {
    bounds: Bounds,
    /// The active kinds of perturbations.
    active_perturbations: ActivePerturbations,
    /// The magnitudes of the perturbations.
    magnitudes: PerturbationSettings,
    plant: Plant,
    seed: Seed,
}

impl SimulationSetup {
    /// A setup with the current ruleset and its magnitudes of perturbations.
    #[must_use]
    pub fn new(profile: AirHockeyProfile, seed: Seed, mismatch_seed: Seed) -> Self {
        let magnitudes = PerturbationSettings::default();
        Self::with_ruleset(
            AirHockeyRuleset::CURRENT,
            profile,
            &magnitudes,
            seed,
            mismatch_seed,
        )
    }

    /// A setup with a ruleset, and with magnitudes for the perturbations of the profile. It draws the plant from `mismatch_seed`,
    /// which takes milliseconds, so use one setup for many episodes.
    #[must_use]
    pub fn with_ruleset(
        ruleset: AirHockeyRuleset,
        profile: AirHockeyProfile,
        magnitudes: &PerturbationSettings,
        seed: Seed,
        mismatch_seed: Seed,
    ) -> Self {
        let active_perturbations = profile.active_perturbations();
        Self {
            bounds: Bounds::of(ruleset),
            plant: Plant::for_perturbations(active_perturbations, magnitudes, mismatch_seed),
            active_perturbations,
            magnitudes: magnitudes.clone(),
            seed,
        }
    }

    /// Replaces the ruleset's bounds on the simulated motion, beyond which a simulation counts as diverged.
    #[must_use]
    pub fn with_bounds(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// The seed of an episode; `index` is its index within the evaluation.
    pub(crate) fn episode_seed(&self, task: impl Into<Task>, index: u32) -> Seed {
        self.seed.episode(task, index)
    }

    /// An episode at its start.
    #[must_use]
    pub fn episode(
        &self,
        task: AirHockeyTask,
        index: u32,
        interpolation: Interpolation,
    ) -> Episode {
        Episode::new(
            task,
            interpolation,
            self.active_perturbations,
            &self.magnitudes,
            &self.plant,
            self.episode_seed(task, index),
        )
        .with_bounds(self.bounds)
    }

    /// A game at the start of its first rally. The setup's seed must be the game's.
    #[must_use]
    pub fn game(&self, interpolation: [Interpolation; 2]) -> Game {
        Game::new(GameSetup {
            interpolation,
            active_perturbations: self.active_perturbations,
            settings: self.magnitudes.clone(),
            plant: self.plant.clone(),
            seed: self.seed,
        })
        .with_bounds(self.bounds)
    }
}

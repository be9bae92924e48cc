use faceoff_sim::{Bounds, Episode, Game, GameSetup, PerturbationSettings, Plant};
use faceoff_types::{Factors, Interpolation, Profile, Ruleset, Seed, Task};

/// Common settings of all episodes of an evaluation or all rallies of a game: rules, perturbations, the season's plant and
/// the seed from which the seeds of episodes and rallies are derived.
#[derive(Debug, Clone)]
pub struct Arena {
    bounds: Bounds,
    factors: Factors,
    settings: PerturbationSettings,
    plant: Plant,
    seed: Seed,
}

impl Arena {
    /// An arena with the current ruleset and its magnitudes.
    #[must_use]
    pub fn new(profile: Profile, seed: Seed, mismatch_seed: Seed) -> Self {
        let magnitudes = PerturbationSettings::default();
        Self::with_ruleset(Ruleset::CURRENT, profile, &magnitudes, seed, mismatch_seed)
    }

    /// An arena with a ruleset, and magnitudes for the factors of the profile. Drawing the plant takes milliseconds, so use an
    /// arena for many episodes.
    #[must_use]
    pub fn with_ruleset(
        ruleset: Ruleset,
        profile: Profile,
        magnitudes: &PerturbationSettings,
        seed: Seed,
        mismatch_seed: Seed,
    ) -> Self {
        let factors = profile.factors();
        Self {
            bounds: Bounds::of(ruleset),
            plant: Plant::for_factors(factors, magnitudes, mismatch_seed),
            factors,
            settings: magnitudes.clone(),
            seed,
        }
    }

    /// Replaces the ruleset's bounds on the simulated world.
    #[must_use]
    pub fn with_bounds(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// The seed of an episode; `index` is its index within the evaluation.
    pub(crate) fn seed(&self, task: Task, index: u32) -> Seed {
        self.seed.episode(task, index)
    }

    /// An episode at its start.
    #[must_use]
    pub fn episode(&self, task: Task, index: u32, interpolation: Interpolation) -> Episode {
        Episode::new(
            task,
            interpolation,
            self.factors,
            &self.settings,
            &self.plant,
            self.seed(task, index),
        )
        .with_bounds(self.bounds)
    }

    /// A game at the start of its first rally. The arena's seed must be the game's.
    #[must_use]
    pub fn game(&self, interpolation: [Interpolation; 2]) -> Game {
        Game::new(GameSetup {
            interpolation,
            factors: self.factors,
            settings: self.settings.clone(),
            plant: self.plant.clone(),
            seed: self.seed,
        })
        .with_bounds(self.bounds)
    }
}

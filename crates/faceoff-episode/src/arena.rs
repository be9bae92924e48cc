use faceoff_sim::{Bounds, Episode, Game, GameSetup, PerturbationSettings, Plant};
use faceoff_types::{Factors, Interpolation, Profile, Ruleset, Seed, Task};

/// What all episodes of an evaluation share, or all rallies of a game: the rules, the perturbations, the season's plant and the
/// seed that theirs derive from.
#[derive(Debug, Clone)]
pub struct Arena {
    bounds: Bounds,
    factors: Factors,
    settings: PerturbationSettings,
    plant: Plant,
    seed: Seed,
}

impl Arena {
    /// By the current ruleset, with its magnitudes.
    #[must_use]
    pub fn new(profile: Profile, seed: Seed, mismatch_seed: Seed) -> Self {
        let magnitudes = PerturbationSettings::default();
        Self::by(Ruleset::CURRENT, profile, &magnitudes, seed, mismatch_seed)
    }

    /// By a ruleset, with magnitudes of the factors that the profile switches on. Draws the plant, which takes
    /// milliseconds: make one, play many.
    #[must_use]
    pub fn by(
        ruleset: Ruleset,
        profile: Profile,
        magnitudes: &PerturbationSettings,
        seed: Seed,
        mismatch_seed: Seed,
    ) -> Self {
        let factors = profile.factors();
        Self {
            bounds: Bounds::of(ruleset),
            plant: Plant::under(factors, magnitudes, mismatch_seed),
            factors,
            settings: magnitudes.clone(),
            seed,
        }
    }

    /// The same within other bounds than the ruleset's.
    #[must_use]
    pub fn within(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// An episode's own seed; `index` counts within the evaluation.
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
        .within(self.bounds)
    }

    /// A game at the start of its first rally; the seed is the game's own.
    #[must_use]
    pub fn game(&self, interpolation: [Interpolation; 2]) -> Game {
        Game::new(GameSetup {
            interpolation,
            factors: self.factors,
            settings: self.settings.clone(),
            plant: self.plant.clone(),
            seed: self.seed,
        })
        .within(self.bounds)
    }
}

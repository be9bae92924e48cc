//! A batch: many episodes of one task, stepped at once for training.
//!
//! A batch has a fixed number of *worlds*, each of which runs one episode at a time. Observations and actions are one array each, a
//! row per world. A world whose episode ends starts its next episode at once. The episodes of a world depend only on its row, not on
//! the threads. The threads come from rayon's current pool: callers set their number with `ThreadPool::install`.

use crate::AirHockeyTask;
use crate::{
    ActivePerturbations,
    channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
    dynamics::simd_level::SimdLevel,
    episode::{Episode, StepOutcome},
    episode_step::step_episodes_on,
    robot::plant::Plant,
};
use crate::{Interpolation, PerturbationSettings};
use faceoff_types::Seed;
use rayon::prelude::*;

/// Number of worlds that one thread steps at once.
const WORLDS_PER_CHUNK: usize = 4;

/// Task, perturbations and seed of a batch.
#[derive(Debug, Clone)]
pub struct BatchSetup {
    pub task: AirHockeyTask,
    /// How actions become trajectories.
    pub interpolation: Interpolation,
    /// The active kinds of perturbations.
    pub active_perturbations: ActivePerturbations,
    /// Magnitudes of the perturbations.
    pub settings: PerturbationSettings,
    /// The physical properties of the arms; nominal unless the active perturbations contain the model mismatch.
    pub plant: Plant,
    /// Seed of the evaluation whose episodes the batch runs.
    pub seed: Seed,
    /// Number of worlds; at least 1.
    pub worlds: u32,
}

/// Worlds of one task. Of `n` worlds, the world in row `w` runs the episodes w, w + n, w + 2 n, …
#[derive(Debug, Clone)]
pub struct Batch {
    setup: BatchSetup,
    worlds: Vec<BatchWorld>,
    observations: Vec<f64>,
    outcomes: Vec<BatchOutcome>,
    simd_level: SimdLevel,
}

/// A world of a batch: its current episode.
#[derive(Debug, Clone)]
struct BatchWorld {
    episode: Episode,
    /// Index of the episode within the evaluation.
    episode_index: u32,
}

/// Result of a control step of one world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatchOutcome {
    /// Index, within the evaluation, of the episode that the step belongs to.
    pub episode: u32,
    /// The end of the episode, if this step ended it, and the constraint values.
    pub step: StepOutcome,
    /// Success, tested on the state after the step; meaningful only if the episode ended.
    pub success: bool,
    /// The observation after the step. After an end the batch's row already holds the next episode's.
    last_observation: [f64; OBSERVATION_WITH_OPPONENT_LEN],
}

impl BatchOutcome {
    /// The value before the first step.
    const NONE: Self = Self {
        episode: 0,
        step: StepOutcome::NONE,
        success: false,
        last_observation: [0.0; OBSERVATION_WITH_OPPONENT_LEN],
    };

    /// The observation after the step: 23 numbers; the opponent's are zero in tasks without an opponent.
    #[must_use]
    pub const fn last_observation(&self) -> &[f64; OBSERVATION_WITH_OPPONENT_LEN] {
        &self.last_observation
    }
}

impl Batch {
    /// All worlds at the start of their first episode.
    #[must_use]
    pub fn new(setup: BatchSetup) -> Self {
        let worlds: Vec<BatchWorld> = (0..setup.worlds.max(1))
            .into_par_iter()
            .map(|episode_index| setup.start_world(episode_index))
            .collect();
        let mut observations = Vec::with_capacity(worlds.len() * setup.observation_len());
        for world in &worlds {
            observations.extend_from_slice(world.episode.observation());
        }
        Self {
            outcomes: vec![BatchOutcome::NONE; worlds.len()],
            setup,
            worlds,
            observations,
            simd_level: SimdLevel::fastest(),
        }
    }

    /// The same batch, computed with another instruction set. All of them give the same bits.
    #[must_use]
    pub fn with_simd_level(mut self, simd_level: SimdLevel) -> Self {
        self.simd_level = simd_level;
        self
    }

    /// Numbers in one observation.
    #[must_use]
    pub fn observation_len(&self) -> usize {
        self.setup.observation_len()
    }

    /// Numbers in one action.
    #[must_use]
    pub fn action_len(&self) -> usize {
        self.setup.interpolation.len()
    }

    /// The agents' observations, row-major: worlds × [`Batch::observation_len`].
    #[must_use]
    pub fn observations(&self) -> &[f64] {
        &self.observations
    }

    /// One control step of every world. `actions` is row-major, worlds × [`Batch::action_len`], and finite. Returns an
    /// outcome per world.
    ///
    /// # Panics
    /// If `actions` has another length.
    pub fn step(&mut self, actions: &[f64]) -> &[BatchOutcome] {
        let (action_len, observation_len) = (self.action_len(), self.observation_len());
        assert_eq!(
            actions.len(),
            self.worlds.len() * action_len,
            "expected an action of {action_len} numbers for each of {} worlds",
            self.worlds.len()
        );
        let (setup, simd_level) = (&self.setup, self.simd_level);
        let worlds = self.worlds.par_chunks_mut(WORLDS_PER_CHUNK);
        let actions = actions.par_chunks(WORLDS_PER_CHUNK * action_len);
        let observations = self
            .observations
            .par_chunks_mut(WORLDS_PER_CHUNK * observation_len);
        let outcomes = self.outcomes.par_chunks_mut(WORLDS_PER_CHUNK);
        worlds
            .zip(actions)
            .zip(observations)
            .zip(outcomes)
            .for_each(|(((worlds, actions), observations), outcomes)| {
                let mut steps = [StepOutcome::NONE; WORLDS_PER_CHUNK];
                let steps = &mut steps[..worlds.len()];
                let mut episodes: Vec<&mut Episode> =
                    worlds.iter_mut().map(|world| &mut world.episode).collect();
                let actions: Vec<&[f64]> = actions.chunks_exact(action_len).collect();
                step_episodes_on(simd_level, &mut episodes, &actions, steps);
                let rows = observations.chunks_exact_mut(observation_len);
                for (((world, step), row), outcome) in
                    worlds.iter_mut().zip(steps).zip(rows).zip(outcomes)
                {
                    *outcome = world.end_step(setup, *step);
                    row.copy_from_slice(world.episode.observation());
                }
            });
        &self.outcomes
    }
}

impl BatchSetup {
    fn start_world(&self, episode_index: u32) -> BatchWorld {
        let seed = self.seed.episode(self.task, episode_index);
        let episode = Episode::new(
            self.task,
            self.interpolation,
            self.active_perturbations,
            &self.settings,
            &self.plant,
            seed,
        );
        BatchWorld {
            episode,
            episode_index,
        }
    }

    fn observation_len(&self) -> usize {
        crate::channel::observation::len(self.task)
    }
}

impl BatchWorld {
    /// The result of a step. If the step ended the episode, the world starts its next one.
    fn end_step(&mut self, setup: &BatchSetup, step: StepOutcome) -> BatchOutcome {
        let mut last_observation = [0.0; OBSERVATION_WITH_OPPONENT_LEN];
        let observation = self.episode.observation();
        last_observation[..observation.len()].copy_from_slice(observation);
        let outcome = BatchOutcome {
            episode: self.episode_index,
            step,
            success: self.episode.success(),
            last_observation,
        };
        if step.end.is_some() {
            *self = setup.start_world(self.episode_index.wrapping_add(setup.worlds.max(1)));
        }
        outcome
    }
}

//! Many episodes stepped together, for training.
//!
//! Observations and actions lie in one array each, a row per world. A world whose episode ends starts its
//! next one at once. What a world plays depends on its row alone, not on the threads: they come from
//! rayon's current pool, so that a caller chooses their number with `ThreadPool::install`.

use crate::{
    channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
    dynamics::path::LanePath,
    episode::{Episode, StepOutcome},
    robot::plant::Plant,
    together::step_together_by,
};
use faceoff_types::{Factors, Interpolation, PerturbationSettings, Seed, Task};
use rayon::prelude::*;

/// Worlds that a thread takes at a time, and steps together.
const WORLDS_AT_A_TIME: usize = 4;

/// What is played in a batch.
#[derive(Debug, Clone)]
pub struct BatchSetup {
    pub task: Task,
    /// How actions become trajectories.
    pub interpolation: Interpolation,
    pub factors: Factors,
    pub settings: PerturbationSettings,
    /// The arms; nominal unless the factors contain the model mismatch.
    pub plant: Plant,
    /// Episodes are those that an evaluation with this seed plays.
    pub seed: Seed,
    /// Number of worlds; at least 1.
    pub worlds: u32,
}

/// Worlds of one task. World `w` of `n` plays the episodes w, w + n, w + 2 n, …
#[derive(Debug, Clone)]
pub struct Batch {
    setup: BatchSetup,
    worlds: Vec<World>,
    observations: Vec<f64>,
    outcomes: Vec<BatchOutcome>,
    path: LanePath,
}

#[derive(Debug, Clone)]
struct World {
    episode: Episode,
    number: u32,
}

/// What a control step of one world led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatchOutcome {
    /// The episode that the step belongs to.
    pub episode: u32,
    /// Its end, if it came, and constraint values.
    pub step: StepOutcome,
    /// Success, tested on the state after the step; tells something at an end only.
    pub success: bool,
    /// The observation after the step; at an end the batch's row shows the next episode's already.
    last_observation: [f64; OBSERVATION_WITH_OPPONENT_LEN],
}

impl BatchOutcome {
    /// Before the first step.
    const NONE: Self = Self {
        episode: 0,
        step: StepOutcome::NONE,
        success: false,
        last_observation: [0.0; OBSERVATION_WITH_OPPONENT_LEN],
    };

    /// The observation after the step, of the task's length or longer: 23 numbers, the opponent's zero
    /// where there is none.
    #[must_use]
    pub const fn last_observation(&self) -> &[f64; OBSERVATION_WITH_OPPONENT_LEN] {
        &self.last_observation
    }
}

impl Batch {
    /// All worlds at the start of their first episode.
    #[must_use]
    pub fn new(setup: BatchSetup) -> Self {
        let worlds: Vec<World> = (0..setup.worlds.max(1))
            .into_par_iter()
            .map(|number| setup.start(number))
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
            path: LanePath::fastest(),
        }
    }

    /// The same batch by another path: all give the same bits.
    #[must_use]
    pub fn by(mut self, path: LanePath) -> Self {
        self.path = path;
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

    /// What the agents are told: [worlds][[`Batch::observation_len`]].
    #[must_use]
    pub fn observations(&self) -> &[f64] {
        &self.observations
    }

    /// One control step of every world. `actions` is [worlds][[`Batch::action_len`]], finite. Returns an
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
        let (setup, path) = (&self.setup, self.path);
        let worlds = self.worlds.par_chunks_mut(WORLDS_AT_A_TIME);
        let actions = actions.par_chunks(WORLDS_AT_A_TIME * action_len);
        let observations = self
            .observations
            .par_chunks_mut(WORLDS_AT_A_TIME * observation_len);
        let outcomes = self.outcomes.par_chunks_mut(WORLDS_AT_A_TIME);
        worlds
            .zip(actions)
            .zip(observations)
            .zip(outcomes)
            .for_each(|(((worlds, actions), observations), outcomes)| {
                let mut steps = [StepOutcome::NONE; WORLDS_AT_A_TIME];
                let steps = &mut steps[..worlds.len()];
                let mut episodes: Vec<&mut Episode> =
                    worlds.iter_mut().map(|world| &mut world.episode).collect();
                let actions: Vec<&[f64]> = actions.chunks_exact(action_len).collect();
                step_together_by(path, &mut episodes, &actions, steps);
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
    fn start(&self, number: u32) -> World {
        let seed = self.seed.episode(self.task, number);
        let episode = Episode::new(
            self.task,
            self.interpolation,
            self.factors,
            &self.settings,
            &self.plant,
            seed,
        );
        World { episode, number }
    }

    fn observation_len(&self) -> usize {
        crate::channel::observation::len(self.task)
    }
}

impl World {
    /// What a step led to; after an end the next episode starts.
    fn end_step(&mut self, setup: &BatchSetup, step: StepOutcome) -> BatchOutcome {
        let mut last_observation = [0.0; OBSERVATION_WITH_OPPONENT_LEN];
        let observation = self.episode.observation();
        last_observation[..observation.len()].copy_from_slice(observation);
        let outcome = BatchOutcome {
            episode: self.number,
            step,
            success: self.episode.success(),
            last_observation,
        };
        if step.end.is_some() {
            *self = setup.start(self.number.wrapping_add(setup.worlds.max(1)));
        }
        outcome
    }
}

//! Output arrays of a step, a row per world, in memory of Python or of this crate. The *episode info* of a world is 12 numbers:
//! how its episode ended, whether it succeeded, its number and steps, its constraint values, and which constraints were violated.

use crate::{
    observation,
    setup::Setup,
    world::{STATE_LEN, World},
};
use faceoff_sim::episode::ends;
use rayon::prelude::*;

/// Count of numbers in a world's episode info; see [`write_episode_info`].
pub const EPISODE_INFO_LEN: usize = 12;

/// The output arrays: the rows of all worlds, or of consecutive ones.
pub struct Outputs<'a> {
    /// Count of numbers in an observation.
    pub observation_len: usize,
    /// [worlds][observation]: the next observation.
    pub observations: &'a mut [f32],
    /// [worlds][observation]: the last observation of an episode whose successor has begun; other rows are not
    /// written. Empty if not requested.
    pub final_observations: &'a mut [f32],
    /// [worlds]: rewards of the step.
    pub rewards: &'a mut [f64],
    /// [worlds]: whether the task ended the episode.
    pub terminated: &'a mut [bool],
    /// [worlds]: whether the horizon ended the episode.
    pub truncated: &'a mut [bool],
    /// [worlds][[`EPISODE_INFO_LEN`]]: see [`write_episode_info`].
    pub episode_info: &'a mut [f64],
    /// [worlds][[`STATE_LEN`]]: the true state after the step. Empty if not requested.
    pub states: &'a mut [f64],
    /// [worlds][[`STATE_LEN`]]: the present true state, that of the new episode if one has begun. Empty if not
    /// requested.
    pub next_states: &'a mut [f64],
}

impl<'a> Outputs<'a> {
    /// Splits the rows into chunks of `worlds` rows, in order.
    pub fn split(self, worlds: usize) -> Vec<Outputs<'a>> {
        let count = self.rewards.len().div_ceil(worlds);
        let len = self.observation_len;
        let mut observations = self.observations.chunks_mut(len * worlds);
        let mut finals = self.final_observations.chunks_mut(len * worlds);
        let mut rewards = self.rewards.chunks_mut(worlds);
        let mut terminated = self.terminated.chunks_mut(worlds);
        let mut truncated = self.truncated.chunks_mut(worlds);
        let mut episode_info = self.episode_info.chunks_mut(EPISODE_INFO_LEN * worlds);
        let mut states = self.states.chunks_mut(STATE_LEN * worlds);
        let mut next_states = self.next_states.chunks_mut(STATE_LEN * worlds);
        (0..count)
            .map(|_| Outputs {
                observation_len: len,
                observations: observations.next().unwrap_or_default(),
                final_observations: finals.next().unwrap_or_default(),
                rewards: rewards.next().unwrap_or_default(),
                terminated: terminated.next().unwrap_or_default(),
                truncated: truncated.next().unwrap_or_default(),
                episode_info: episode_info.next().unwrap_or_default(),
                states: states.next().unwrap_or_default(),
                next_states: next_states.next().unwrap_or_default(),
            })
            .collect()
    }

    /// Writes the row of a world that was reset or restored.
    pub fn write_start(&mut self, row: usize, world: &World) {
        self.write_observation(row, world);
        self.write_state_after_step(row, world);
        self.write_current_state(row, world);
        let values = world.episode.constraints();
        let constraints = [values.ee, values.link, values.joint_pos, values.joint_vel];
        write_episode_info(
            world,
            &constraints,
            &mut self.episode_info[row * EPISODE_INFO_LEN..][..EPISODE_INFO_LEN],
        );
        self.rewards[row] = 0.0;
        self.terminated[row] = false;
        self.truncated[row] = false;
    }

    /// Writes the next observation.
    pub fn write_observation(&mut self, row: usize, world: &World) {
        let len = self.observation_len;
        let target = &mut self.observations[row * len..][..len];
        observation::write(world.episode.observation(), target);
    }

    /// Writes the last observation of an episode, before a new one begins.
    pub fn write_final_observation(&mut self, row: usize, world: &World) {
        let len = self.observation_len;
        if !self.final_observations.is_empty() {
            let target = &mut self.final_observations[row * len..][..len];
            observation::write(world.episode.observation(), target);
        }
    }

    /// Writes the state after the step.
    pub fn write_state_after_step(&mut self, row: usize, world: &World) {
        if !self.states.is_empty() {
            self.states[row * STATE_LEN..][..STATE_LEN].copy_from_slice(&world.state());
        }
    }

    /// Writes the current state: after the end of an episode, that of the next one if that begins in the same step.
    pub fn write_current_state(&mut self, row: usize, world: &World) {
        if !self.next_states.is_empty() {
            self.next_states[row * STATE_LEN..][..STATE_LEN].copy_from_slice(&world.state());
        }
    }
}

/// Writes a world's episode info: the code of the episode's end (−1 while it runs), success, the episode's number, its steps, the
/// values of the constraints ee, link, joint_pos and joint_vel, and whether each was violated in this episode.
pub fn write_episode_info(world: &World, constraints: &[f64; 4], episode_info: &mut [f64]) {
    let violations = world.episode.violations();
    let code = |end| (0..).zip(ends::ALL).find(|(_, other)| *other == end);
    episode_info[0] = world
        .end
        .and_then(code)
        .map_or(-1.0, |(code, _): (u8, _)| f64::from(code));
    episode_info[1] = f64::from(u8::from(world.succeeds()));
    episode_info[2] = f64::from(world.episode_start.number);
    episode_info[3] = f64::from(world.episode.steps());
    episode_info[4..8].copy_from_slice(constraints);
    for (number, is_violated) in episode_info[8..].iter_mut().zip([
        violations.ee,
        violations.link,
        violations.joint_pos,
        violations.joint_vel,
    ]) {
        *number = f64::from(u8::from(is_violated));
    }
}

/// Output arrays in memory of this crate, for a step that runs in the background.
pub struct OwnedOutputs {
    observation_len: usize,
    observations: Vec<f32>,
    final_observations: Vec<f32>,
    rewards: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    episode_info: Vec<f64>,
    states: Vec<f64>,
    next_states: Vec<f64>,
}

impl OwnedOutputs {
    /// Zeroed rows for `worlds` worlds; `with_states`: also for true states.
    pub fn new(setup: &Setup, worlds: usize, with_states: bool) -> Self {
        let observation_len = setup.observation_len();
        let states_len = if with_states { worlds * STATE_LEN } else { 0 };
        Self {
            observation_len,
            observations: vec![0.0; worlds * observation_len],
            final_observations: vec![0.0; worlds * observation_len],
            rewards: vec![0.0; worlds],
            terminated: vec![false; worlds],
            truncated: vec![false; worlds],
            episode_info: vec![0.0; worlds * EPISODE_INFO_LEN],
            states: vec![0.0; states_len],
            next_states: vec![0.0; states_len],
        }
    }

    /// The arrays for writing.
    pub fn outputs(&mut self) -> Outputs<'_> {
        Outputs {
            observation_len: self.observation_len,
            observations: &mut self.observations,
            final_observations: &mut self.final_observations,
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            episode_info: &mut self.episode_info,
            states: &mut self.states,
            next_states: &mut self.next_states,
        }
    }

    /// Copies all values to rows of the same lengths; true states and final observations only if requested.
    pub fn copy_to(&self, to: &mut Outputs<'_>) {
        to.observations.copy_from_slice(&self.observations);
        to.rewards.copy_from_slice(&self.rewards);
        to.terminated.copy_from_slice(&self.terminated);
        to.truncated.copy_from_slice(&self.truncated);
        to.episode_info.copy_from_slice(&self.episode_info);
        copy_if_present(&self.final_observations, to.final_observations);
        copy_if_present(&self.states, to.states);
        copy_if_present(&self.next_states, to.next_states);
    }
}

fn copy_if_present<T: Copy>(from: &[T], to: &mut [T]) {
    if !to.is_empty() && !from.is_empty() {
        to.copy_from_slice(from);
    }
}

/// Chunks of worlds with their rows, for parallel processing.
pub fn chunks_with_worlds<'a, 'w>(
    worlds: &'w mut [World],
    outputs: Outputs<'a>,
    chunk_size: usize,
) -> impl IndexedParallelIterator<Item = (&'w mut [World], Outputs<'a>)> {
    let chunks = outputs.split(chunk_size);
    worlds
        .par_chunks_mut(chunk_size)
        .zip(chunks.into_par_iter())
}

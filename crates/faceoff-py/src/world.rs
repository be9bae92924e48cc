//! One world of an environment: a simulated table with its running episode and that episode's actions so far.

use crate::{errors::argument_error, reward, setup::Setup};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    Episode, EpisodeState, JOINTS, Plant, StepOutcome, ViolatedConstraints, model::INITIAL_Q,
};
use faceoff_types::{EpisodeEnd, Seed};
use pyo3::prelude::*;
use std::sync::Arc;

/// Count of numbers in a true state: the puck's 6 in the table frame, joint positions, velocities and filtered velocities (7
/// each), the end effector's 3, and the 3 of the opponent's, zero without one, each in its robot's base frame.
pub const STATE_LEN: usize = 6 + 3 * JOINTS + 6;

/// The seed, number and puck from which an episode starts. Two episodes with the same ones and the same setup start equally.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeStart {
    /// The number from which the episode's seeds are derived.
    pub seed: u64,
    /// The episode's number in an evaluation with that seed.
    pub number: u32,
    /// The puck's initial state, if the caller set it.
    pub puck: Option<[f64; 6]>,
}

/// A world with its running episode.
#[derive(Debug, Clone)]
pub struct World {
    /// The simulated episode.
    pub episode: Episode,
    pub episode_start: EpisodeStart,
    /// Last commanded joint positions, rad.
    pub commanded: [f64; JOINTS],
    /// All actions since the episode's start, as passed by the caller.
    pub actions: Vec<f64>,
    /// How the episode ended; `None` while it runs.
    pub end: Option<EpisodeEnd>,
    /// The simulated arm.
    plant: Arc<Plant>,
    /// The reward's potential of the present state, points; the next reward contains its change.
    potential: f64,
    violations: ViolatedConstraints,
}

/// Results of a world's step.
#[derive(Debug, Clone, Copy)]
pub struct StepResult {
    /// The default reward of the step.
    pub reward: f64,
    /// The largest constraint values during the step: ee, link, joint_pos, joint_vel.
    pub constraints: [f64; 4],
}

impl World {
    /// A world at the start of an episode. Drawing a plant takes milliseconds, so the plant of `previous` is reused if the new one
    /// would be the same: with the same seed, or if the setup has a `mismatch_seed`.
    pub fn start(setup: &Setup, episode_start: EpisodeStart, previous: Option<&Self>) -> Self {
        let seed = Seed::from_number(episode_start.seed);
        let plant = match previous {
            Some(previous)
                if previous.episode_start.seed == episode_start.seed
                    || setup.mismatch_seed.is_some() =>
            {
                Arc::clone(&previous.plant)
            }
            _ => Arc::new(setup.plant(seed)),
        };
        let episode = setup.episode(&plant, seed, episode_start.number, episode_start.puck);
        Self {
            potential: reward::potential(setup.task, &episode),
            violations: episode.violations(),
            commanded: INITIAL_Q,
            actions: Vec::new(),
            end: None,
            episode,
            episode_start,
            plant,
        }
    }

    /// Starts the next episode of the same seed.
    pub fn start_next(&mut self, setup: &Setup) {
        let episode_start = EpisodeStart {
            seed: self.episode_start.seed,
            number: self.episode_start.number.wrapping_add(1),
            puck: None,
        };
        *self = Self::start(setup, episode_start, Some(self));
    }

    /// Updates the world after a step of its episode, and returns the step's results.
    pub fn apply_step(&mut self, setup: &Setup, outcome: &StepOutcome) -> StepResult {
        let is_truncated = self.episode.steps() >= setup.max_episode_steps;
        self.end = outcome.end.or(is_truncated.then_some(EpisodeEnd::HORIZON));
        let potential = reward::potential(setup.task, &self.episode);
        let violations = self.episode.violations();
        let mut reward =
            potential - self.potential - reward::new_penalty_points(self.violations, violations);
        if self.succeeds() {
            reward += reward::SUCCESS;
        }
        self.potential = potential;
        self.violations = violations;
        let values = outcome.constraints;
        StepResult {
            reward,
            constraints: [values.ee, values.link, values.joint_pos, values.joint_vel],
        }
    }

    /// Whether the episode has ended in success.
    pub fn succeeds(&self) -> bool {
        self.end.is_some_and(|end| end != EpisodeEnd::AGENT_FAULT) && self.episode.success()
    }

    /// The true state.
    pub fn state(&self) -> [f64; STATE_LEN] {
        flatten(&self.episode.state())
    }

    /// Simulates an episode's actions again from its start.
    ///
    /// # Errors
    /// If the actions are not those of a possible episode.
    pub fn replay(setup: &Setup, episode_start: EpisodeStart, actions: Vec<f64>) -> PyResult<Self> {
        let action_format = setup.action_format();
        let len = action_format.len();
        let max_len = len * setup.max_episode_steps as usize;
        if !actions.len().is_multiple_of(len) || actions.len() > max_len {
            return Err(argument_error(
                "state",
                format!("actions of {len} numbers each, at most {max_len} numbers"),
                format!("{} numbers", actions.len()),
            ));
        }
        action_format.check(&actions, |index| format!(" of the state's action {index}"))?;
        let mut world = Self::start(setup, episode_start, None);
        let mut command = vec![0.0; len];
        for (step, action) in actions.chunks_exact(len).enumerate() {
            if world.end.is_some() {
                return Err(argument_error(
                    "state",
                    format!("no action after the episode's end at step {step}"),
                    format!("{} actions", actions.len() / len),
                ));
            }
            action_format.command(action, &mut world.commanded, &mut command);
            let outcome = world.episode.step(&command);
            world.apply_step(setup, &outcome);
        }
        world.actions = actions;
        Ok(world)
    }
}

fn flatten(state: &EpisodeState) -> [f64; STATE_LEN] {
    let mut numbers = [0.0; STATE_LEN];
    let mut rest = &mut numbers[..];
    for part in [
        &state.puck[..],
        &state.q,
        &state.dq,
        &state.dq_filtered,
        &state.ee,
        &state.opponent_ee.unwrap_or_default(),
    ] {
        let (target, remaining) = rest.split_at_mut(part.len());
        target.copy_from_slice(part);
        rest = remaining;
    }
    numbers
}

/// Checks an initial state of the puck: x, y, yaw, vx, vy and yaw rate in the table frame.
///
/// # Errors
/// If it is not on the table, too fast or not finite.
pub fn check_puck(task: AirHockeyTask, puck: &[f64; 6]) -> PyResult<()> {
    use faceoff_sim::table::geometry::{PUCK, TABLE};
    let [x, y, ..] = *puck;
    // The largest |x| and |y| of the puck's centre.
    let (max_x, max_y) = (
        TABLE.half_length_m() - PUCK.radius_m,
        TABLE.half_width_m() - PUCK.radius_m,
    );
    let speed = (puck[3] * puck[3] + puck[4] * puck[4]).sqrt();
    let is_valid = puck.iter().all(|x| x.is_finite())
        && x.abs() <= max_x
        && y.abs() <= max_y
        && speed <= 20.0
        && puck[5].abs() <= 500.0;
    if is_valid {
        return Ok(());
    }
    Err(argument_error(
        "puck",
        format!(
            "x, y, yaw, vx, vy, yaw rate of a puck on the table ({task}): |x| <= {max_x:.5}, |y| <= {max_y:.5}, \
             at most 20 m/s and 500 rad/s"
        ),
        format!("{puck:?}"),
    ))
}

//! One world of an environment: the episode under way, and how it came there.

use crate::{errors::argument, reward, setup::Setup};
use faceoff_sim::{Episode, EpisodeState, JOINTS, Plant, StepOutcome, model::INITIAL_Q};
use faceoff_types::{EpisodeEnd, Seed, Task, Violations};
use pyo3::prelude::*;
use std::sync::Arc;

/// Numbers of a true state: the puck's 6 in the table frame, joint positions, velocities and filtered velocities (7
/// each), the end effector's 3, and the 3 of the opponent's, zero without one, each in its robot's base frame.
pub const STATE_LEN: usize = 6 + 3 * JOINTS + 6;

/// Which episode a world plays.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// The number that its seeds derive from.
    pub seed: u64,
    /// The episode's, in the order of an evaluation with that seed.
    pub number: u32,
    /// The puck's first state, if it was given.
    pub puck: Option<[f64; 6]>,
}

/// An episode under way.
#[derive(Debug, Clone)]
pub struct World {
    /// The simulated episode.
    pub episode: Episode,
    /// Which one it is.
    pub origin: Origin,
    /// Its last commanded joint positions, rad.
    pub commanded: [f64; JOINTS],
    /// All actions since its start, as they were given.
    pub actions: Vec<f64>,
    /// How it ended; `None` while it is under way.
    pub end: Option<EpisodeEnd>,
    plant: Arc<Plant>,
    potential: f64,
    violations: Violations,
}

/// What a step of a world led to.
#[derive(Debug, Clone, Copy)]
pub struct Stepped {
    /// The default reward.
    pub reward: f64,
    /// The largest constraint values.
    pub constraints: [f64; 4],
}

impl World {
    /// At the start of an episode. A plant is drawn, which takes milliseconds, unless `before` has the same seed's.
    pub fn start(setup: &Setup, origin: Origin, before: Option<&Self>) -> Self {
        let seed = Seed::from_number(origin.seed);
        let plant = match before {
            Some(before) if before.origin.seed == origin.seed || setup.mismatch_seed.is_some() => {
                Arc::clone(&before.plant)
            }
            _ => Arc::new(setup.plant(seed)),
        };
        let episode = setup.episode(&plant, seed, origin.number, origin.puck);
        Self {
            potential: reward::potential(setup.task, &episode),
            violations: episode.violations(),
            commanded: INITIAL_Q,
            actions: Vec::new(),
            end: None,
            episode,
            origin,
            plant,
        }
    }

    /// The next episode of the same seed.
    pub fn start_next(&mut self, setup: &Setup) {
        let origin = Origin {
            seed: self.origin.seed,
            number: self.origin.number.wrapping_add(1),
            puck: None,
        };
        *self = Self::start(setup, origin, Some(self));
    }

    /// Takes in what a step of the episode led to.
    pub fn stepped(&mut self, setup: &Setup, outcome: &StepOutcome) -> Stepped {
        let cut = self.episode.steps() >= setup.max_episode_steps;
        self.end = outcome.end.or(cut.then_some(EpisodeEnd::Horizon));
        let potential = reward::potential(setup.task, &self.episode);
        let violations = self.episode.violations();
        let mut reward =
            potential - self.potential - reward::new_points(self.violations, violations);
        if self.succeeds() {
            reward += reward::SUCCESS;
        }
        self.potential = potential;
        self.violations = violations;
        let values = outcome.constraints;
        Stepped {
            reward,
            constraints: [values.ee, values.link, values.joint_pos, values.joint_vel],
        }
    }

    /// Has the episode ended, in success?
    pub fn succeeds(&self) -> bool {
        self.end.is_some_and(|end| end != EpisodeEnd::AgentFault) && self.episode.success()
    }

    /// The true state.
    pub fn state(&self) -> [f64; STATE_LEN] {
        flat(&self.episode.state())
    }

    /// Plays an episode's actions again, from its start.
    ///
    /// # Errors
    /// If they cannot have been played.
    pub fn replay(setup: &Setup, origin: Origin, actions: Vec<f64>) -> PyResult<Self> {
        let reader = setup.actions();
        let len = reader.len();
        let most = len * setup.max_episode_steps as usize;
        if !actions.len().is_multiple_of(len) || actions.len() > most {
            return Err(argument(
                "state",
                format!("actions of {len} numbers each, at most {most} numbers"),
                format!("{} numbers", actions.len()),
            ));
        }
        reader.check(&actions, |at| format!(" of the state's action {at}"))?;
        let mut world = Self::start(setup, origin, None);
        let mut command = vec![0.0; len];
        for (at, action) in actions.chunks_exact(len).enumerate() {
            if world.end.is_some() {
                return Err(argument(
                    "state",
                    format!("no action after the episode's end at step {at}"),
                    format!("{} actions", actions.len() / len),
                ));
            }
            reader.command(action, &mut world.commanded, &mut command);
            let outcome = world.episode.step(&command);
            world.stepped(setup, &outcome);
        }
        world.actions = actions;
        Ok(world)
    }
}

fn flat(state: &EpisodeState) -> [f64; STATE_LEN] {
    let mut all = [0.0; STATE_LEN];
    let mut rest = &mut all[..];
    for part in [
        &state.puck[..],
        &state.q,
        &state.dq,
        &state.dq_filtered,
        &state.ee,
        &state.opponent_ee.unwrap_or_default(),
    ] {
        let (place, after) = rest.split_at_mut(part.len());
        place.copy_from_slice(part);
        rest = after;
    }
    all
}

/// Is it a puck that a task may start with? x, y, yaw, vx, vy and yaw rate in the table frame.
///
/// # Errors
/// If it is not.
pub fn check_puck(task: Task, puck: &[f64; 6]) -> PyResult<()> {
    use faceoff_sim::table::geometry::{PUCK, TABLE};
    let [x, y, ..] = *puck;
    let (along, across) = (
        TABLE.half_length_m() - PUCK.radius_m,
        TABLE.half_width_m() - PUCK.radius_m,
    );
    let speed = (puck[3] * puck[3] + puck[4] * puck[4]).sqrt();
    let is_one = puck.iter().all(|x| x.is_finite())
        && x.abs() <= along
        && y.abs() <= across
        && speed <= 20.0
        && puck[5].abs() <= 500.0;
    if is_one {
        return Ok(());
    }
    Err(argument(
        "puck",
        format!(
            "x, y, yaw, vx, vy, yaw rate of a puck on the table ({task}): |x| <= {along:.5}, |y| <= {across:.5}, \
             at most 20 m/s and 500 rad/s"
        ),
        format!("{puck:?}"),
    ))
}

//! A control step, 20 ms, of several worlds.

use crate::{
    errors::argument_error,
    outputs::{EPISODE_INFO_LEN, Outputs, write_episode_info},
    setup::Setup,
    world::World,
};
use faceoff_sim::{ConstraintValues, Episode, StepOutcome, step_episodes};
use faceoff_types::EpisodeEnd;
use pyo3::prelude::*;

/// When a world whose episode has ended begins the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// The next step begins the next episode and ignores the action.
    NextStep,
    /// The step that ends the episode begins the next one.
    SameStep,
    /// Only a reset begins the next episode; steps before it are refused.
    Disabled,
}

impl Autoreset {
    /// The mode with this name.
    ///
    /// # Errors
    /// If there is none.
    pub fn read(name: &str) -> PyResult<Self> {
        match name {
            "next_step" => Ok(Self::NextStep),
            "same_step" => Ok(Self::SameStep),
            "disabled" => Ok(Self::Disabled),
            other => Err(argument_error("autoreset_mode", "an AutoresetMode", other)),
        }
    }
}

/// Steps consecutive worlds; `actions` is [worlds][action], checked.
pub fn step(
    setup: &Setup,
    autoreset: Autoreset,
    worlds: &mut [World],
    actions: &[f64],
    outputs: &mut Outputs<'_>,
) {
    let action_format = setup.action_format();
    let len = action_format.len();
    let mut commands = vec![0.0; worlds.len() * len];
    let mut is_stepped = vec![true; worlds.len()];
    for (row, world) in worlds.iter_mut().enumerate() {
        // Only with [`Autoreset::NextStep`]: the other modes leave no ended episode when a step begins.
        if world.end.is_some() {
            world.start_next(setup);
            outputs.write_start(row, world);
            is_stepped[row] = false;
        } else {
            let action = &actions[row * len..][..len];
            world.actions.extend_from_slice(action);
            let command = &mut commands[row * len..][..len];
            action_format.command(action, &mut world.commanded, command);
        }
    }
    let outcomes = step_marked(worlds, &is_stepped, &commands, len);
    let stepped = worlds
        .iter_mut()
        .enumerate()
        .filter(|(row, _)| is_stepped[*row]);
    for ((row, world), outcome) in stepped.zip(&outcomes) {
        let result = world.apply_step(setup, outcome);
        outputs.rewards[row] = result.reward;
        outputs.terminated[row] = !matches!(world.end, None | Some(EpisodeEnd::HORIZON));
        outputs.truncated[row] = world.end == Some(EpisodeEnd::HORIZON);
        let episode_info = &mut outputs.episode_info[row * EPISODE_INFO_LEN..][..EPISODE_INFO_LEN];
        write_episode_info(world, &result.constraints, episode_info);
        outputs.write_state_after_step(row, world);
        if world.end.is_some() && autoreset == Autoreset::SameStep {
            outputs.write_final_observation(row, world);
            world.start_next(setup);
        }
        outputs.write_observation(row, world);
        outputs.write_current_state(row, world);
    }
}

/// Steps the episodes of the worlds marked in `is_stepped`; returns an outcome for each of them.
fn step_marked(
    worlds: &mut [World],
    is_stepped: &[bool],
    commands: &[f64],
    len: usize,
) -> Vec<StepOutcome> {
    let (mut episodes, commands): (Vec<&mut Episode>, Vec<&[f64]>) = worlds
        .iter_mut()
        .map(|world| &mut world.episode)
        .zip(commands.chunks_exact(len))
        .zip(is_stepped)
        .filter_map(|(episode_and_command, is_stepped)| is_stepped.then_some(episode_and_command))
        .unzip();
    let placeholder = StepOutcome {
        end: None,
        constraints: ConstraintValues::default(),
    };
    let mut outcomes = vec![placeholder; episodes.len()];
    step_episodes(&mut episodes, &commands, &mut outcomes);
    outcomes
}

//! A game under way: two robots and a puck on one table. It consists of rallies: each lasts until a goal, a foul or
//! another reason to put the puck down again.

use super::settings::GameSettings;
use crate::{actions::ActionFormat, errors::argument_error};
use faceoff_sim::{Command, Game, GameStep, JOINTS, Plant, game::GameProgress, model::INITIAL_Q};
use pyo3::prelude::*;
use std::sync::Arc;

/// What a game starts from; two games with the same origin and settings start equally.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GameOrigin {
    /// The number from which the game's seed is derived.
    pub seed: u64,
    /// The game's number, from 0, among those of the seed.
    pub number: u32,
}

/// A game under way, and what is needed to repeat its current rally.
#[derive(Debug, Clone)]
pub struct ReplayableGame {
    /// The simulated game.
    pub simulation: Game,
    /// What it started from.
    pub origin: GameOrigin,
    /// Whether the game has ended.
    pub is_over: bool,
    /// The game's rally number, steps, score and violations when the current rally began.
    pub rally_start: GameProgress,
    /// Actions of both robots in the current rally, as passed by the caller, step by step; those of a robot that is not
    /// commanded are NaN.
    pub actions: Vec<f64>,
    /// Last commanded joint positions, rad.
    commanded: [[f64; JOINTS]; 2],
    /// The simulated arms.
    plant: Arc<Plant>,
}

impl ReplayableGame {
    /// A game at its start. Drawing the arms takes milliseconds, so those of `previous` are reused if the new ones would be the same.
    pub fn start(settings: &GameSettings, origin: GameOrigin, previous: Option<&Self>) -> Self {
        let plant = match previous {
            Some(previous) if settings.shares_plant(previous.origin.seed, origin.seed) => {
                Arc::clone(&previous.plant)
            }
            _ => Arc::new(settings.plant(origin.seed)),
        };
        let game = Game::new(settings.game_setup(&plant, origin.seed, origin.number));
        Self::new(game, origin, plant)
    }

    fn new(game: Game, origin: GameOrigin, plant: Arc<Plant>) -> Self {
        Self {
            rally_start: game.progress(),
            simulation: game,
            origin,
            is_over: false,
            actions: Vec::new(),
            commanded: [INITIAL_Q; 2],
            plant,
        }
    }

    /// Starts the next game of the seed.
    pub fn start_next(&mut self, settings: &GameSettings) {
        let origin = GameOrigin {
            seed: self.origin.seed,
            number: self.origin.number.wrapping_add(1),
        };
        *self = Self::start(settings, origin, Some(self));
    }

    /// One control step with checked actions; a robot without one holds its arm.
    pub fn step(&mut self, settings: &GameSettings, actions: [Option<&[f64]>; 2]) -> GameStep {
        let formats = settings.action_formats();
        let mut commands: [Option<Vec<f64>>; 2] = [None, None];
        for (robot, action) in actions.into_iter().enumerate() {
            let len = formats[robot].len();
            let Some(action) = action else {
                self.actions.extend(std::iter::repeat_n(f64::NAN, len));
                continue;
            };
            self.actions.extend_from_slice(action);
            let mut command = vec![0.0; len];
            formats[robot].command(action, &mut self.commanded[robot], &mut command);
            commands[robot] = Some(command);
        }
        let step = self
            .simulation
            .step([0, 1].map(|robot| match &commands[robot] {
                Some(command) => Command::Act(command),
                // As for an answer that is too late: the arm holds its position.
                None => Command::Late,
            }));
        if step.rally_end.is_some() {
            self.commanded = [INITIAL_Q; 2];
            self.rally_start = self.simulation.progress();
            self.actions.clear();
        }
        self.is_over = self.simulation.steps() >= settings.max_steps
            || settings.ends_at_divergence && step.divergence.is_some();
        step
    }

    /// Plays a rally again from its start.
    ///
    /// # Errors
    /// If an action is invalid, or the actions end the rally: a snapshot is never taken at a rally's end.
    pub fn replay(
        settings: &GameSettings,
        origin: GameOrigin,
        progress: &GameProgress,
        actions: &[f64],
    ) -> PyResult<Self> {
        let formats = settings.action_formats();
        let (first_len, len) = (formats[0].len(), formats[0].len() + formats[1].len());
        let max_len = (settings.max_steps as usize).saturating_mul(len);
        if !actions.len().is_multiple_of(len) || actions.len() > max_len {
            return Err(argument_error(
                "state",
                format!("actions of {len} numbers each, at most {max_len} numbers"),
                format!("{} numbers", actions.len()),
            ));
        }
        let plant = Arc::new(settings.plant(origin.seed));
        let setup = settings.game_setup(&plant, origin.seed, origin.number);
        let mut game = Self::new(Game::at_rally(setup, progress), origin, plant);
        for (step, both) in actions.chunks_exact(len).enumerate() {
            let (first, second) = both.split_at(first_len);
            let actions = [
                checked_action(&formats[0], first, step)?,
                checked_action(&formats[1], second, step)?,
            ];
            if game.step(settings, actions).rally_end.is_some() {
                return Err(argument_error(
                    "state",
                    "actions of a rally that goes on",
                    format!("ones that end it at step {step}"),
                ));
            }
        }
        Ok(game)
    }
}

/// The action of a robot, checked; `None` if the robot was not commanded.
fn checked_action<'a>(
    format: &ActionFormat,
    action: &'a [f64],
    step: usize,
) -> PyResult<Option<&'a [f64]>> {
    if action.iter().all(|number| number.is_nan()) {
        return Ok(None);
    }
    format.check(action, |_| format!(" of the state's step {step}"))?;
    Ok(Some(action))
}

//! Delays of the perturbation `delay`: the agent sees the puck late, and its actions are applied late (`docs/rules.md`, "Perturbations").

use super::command::Command;
use crate::{DelaySettings, Interpolation};
use crate::{stream::RandomStream, world::World};

/// Length of the first part of an observation, which describes the puck and arrives late: its pose and velocity.
const PUCK_LEN: usize = 6;

/// Largest delay of the observed puck, control steps.
const MAX_LAG_STEPS: usize = 2;

/// Delayed observations and commands between an agent and its robot.
#[derive(Debug, Clone)]
pub(super) struct Latency {
    stream: RandomStream,
    /// Probability that the puck is seen two control steps late, not one.
    second_step_probability: f64,
    interpolation: Interpolation,
    /// The puck now, one and two control steps ago; `None` before the first observation.
    pucks: Option<[[f64; PUCK_LEN]; MAX_LAG_STEPS + 1]>,
    pending: PendingCommand,
}

/// The command of the previous control step, which the robot gets at the next one.
#[derive(Debug, Clone, PartialEq)]
enum PendingCommand {
    /// At the start of an episode: the robot holds its position.
    HoldPosition,
    Action(Vec<f64>),
    /// The agent's answer was late: the robot continues its last trajectory for a while.
    Late,
}

impl Latency {
    pub(super) fn new(
        settings: &DelaySettings,
        interpolation: Interpolation,
        stream: RandomStream,
    ) -> Self {
        Self {
            stream,
            second_step_probability: settings.second_step_probability,
            interpolation,
            pucks: None,
            pending: PendingCommand::HoldPosition,
        }
    }

    /// Replaces the puck of an observation by its state one or two control steps ago. The first observation of an episode has no earlier
    /// state and stays as it is.
    pub(super) fn delay(&mut self, observation: &mut [f64]) {
        let now: [f64; PUCK_LEN] = std::array::from_fn(|i| observation[i]);
        let [one_step_ago, two_steps_ago, _] = self.pucks.unwrap_or([now; MAX_LAG_STEPS + 1]);
        self.pucks = Some([now, one_step_ago, two_steps_ago]);
        // Draw for every observation, so that draws do not depend on earlier ones.
        let is_two_steps_late = self.stream.unit() < self.second_step_probability;
        observation[..PUCK_LEN].copy_from_slice(if is_two_steps_late {
            &two_steps_ago
        } else {
            &one_step_ago
        });
    }

    /// Sets the interpolation of later actions.
    pub(super) fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// Applies the previous control step's command and stores this one.
    pub(super) fn command(&mut self, world: &mut World, robot: usize, command: Command<'_>) {
        match &self.pending {
            PendingCommand::HoldPosition => world.hold(robot, self.interpolation),
            PendingCommand::Action(action) => world.command(robot, self.interpolation, action),
            PendingCommand::Late => world.coast(robot),
        }
        self.pending = match command {
            Command::Act(action) => PendingCommand::Action(action.to_vec()),
            Command::Late => PendingCommand::Late,
        };
    }
}

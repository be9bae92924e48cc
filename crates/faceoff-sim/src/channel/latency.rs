//! Late observations and late actions (RULES, factor `delay`).

use super::command::Command;
use crate::{stream::Stream, world::World};
use faceoff_types::{DelaySettings, Interpolation};

/// Numbers of an observation that describe the puck, the part that arrives late.
const PUCK_LEN: usize = 6;

/// Largest delay of the observed puck, control steps.
const MAX_LAG: usize = 2;

/// Delayed observations and commands between an agent and its robot.
#[derive(Debug, Clone)]
pub(super) struct Latency {
    stream: Stream,
    second_step_probability: f64,
    interpolation: Interpolation,
    /// The puck now, one and two control steps ago; `None` before the first observation.
    pucks: Option<[[f64; PUCK_LEN]; MAX_LAG + 1]>,
    pending: Pending,
}

/// The command that the robot gets at the next control step.
#[derive(Debug, Clone, PartialEq)]
enum Pending {
    /// No command yet: the robot holds its position.
    Nothing,
    Action(Vec<f64>),
    Late,
}

impl Latency {
    pub(super) fn new(
        settings: &DelaySettings,
        interpolation: Interpolation,
        stream: Stream,
    ) -> Self {
        Self {
            stream,
            second_step_probability: settings.second_step_probability,
            interpolation,
            pucks: None,
            pending: Pending::Nothing,
        }
    }

    /// Replaces the puck of an observation by its state one or two control steps ago. At the start of an
    /// episode there is no earlier state.
    pub(super) fn delay(&mut self, observation: &mut [f64]) {
        let now: [f64; PUCK_LEN] = std::array::from_fn(|i| observation[i]);
        let [before, earlier, _] = self.pucks.unwrap_or([now; MAX_LAG + 1]);
        self.pucks = Some([now, before, earlier]);
        // Draw for every observation, so that draws do not depend on earlier ones.
        let second = self.stream.unit() < self.second_step_probability;
        observation[..PUCK_LEN].copy_from_slice(if second { &earlier } else { &before });
    }

    /// Sets the interpolation of later actions.
    pub(super) fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// Applies the previous control step's command and stores this one.
    pub(super) fn command(&mut self, world: &mut World, robot: usize, command: Command<'_>) {
        match &self.pending {
            Pending::Nothing => world.hold(robot, self.interpolation),
            Pending::Action(action) => world.command(robot, self.interpolation, action),
            Pending::Late => world.coast(robot),
        }
        self.pending = match command {
            Command::Act(action) => Pending::Action(action.to_vec()),
            Command::Late => Pending::Late,
        };
    }
}

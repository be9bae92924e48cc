//! Late observations and late actions (RULES, factor `delay`).

use super::command::Command;
use crate::{stream::Stream, world::World};
use faceoff_types::{DelaySettings, Interpolation};

/// Numbers of an observation that describe the puck, the part that arrives late.
const PUCK_LEN: usize = 6;

/// The puck is seen at most this many control steps late.
const MAX_LAG: usize = 2;

/// What is under way between an agent and its robot.
#[derive(Debug, Clone)]
pub(super) struct Latency {
    stream: Stream,
    second_step_probability: f64,
    interpolation: Interpolation,
    /// The puck as it was now, one and two control steps ago; empty before the first look.
    pucks: Option<[[f64; PUCK_LEN]; MAX_LAG + 1]>,
    pending: Pending,
}

/// The command that the robot gets at the next control step.
#[derive(Debug, Clone, PartialEq)]
enum Pending {
    /// Nothing has been commanded yet: the robot stays where it is.
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

    /// Replaces the puck of an observation by the one of one or two control steps ago; before the
    /// first step nothing else has been seen.
    pub(super) fn delay(&mut self, observation: &mut [f64]) {
        let now: [f64; PUCK_LEN] = std::array::from_fn(|i| observation[i]);
        let [before, earlier, _] = self.pucks.unwrap_or([now; MAX_LAG + 1]);
        self.pucks = Some([now, before, earlier]);
        // Drawn at every look, so that draws do not depend on earlier ones.
        let second = self.stream.unit() < self.second_step_probability;
        observation[..PUCK_LEN].copy_from_slice(if second { &earlier } else { &before });
    }

    /// From now on actions are of this interpolation.
    pub(super) fn interpolate(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// Passes on the previous control step's command and keeps this one.
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

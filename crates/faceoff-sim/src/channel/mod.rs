//! The *channel* between an agent and its robot: observations in one direction, commands in the other, both
//! subject to the perturbations (noise, delays, a lost puck).

mod command;
mod latency;
pub mod observation;

use crate::{
    ActivePerturbations, Perturbation, perturbation::noise::ObservationNoise, stream::RandomStream,
    world::World,
};
use crate::{Interpolation, PerturbationSettings};
pub use command::Command;
use faceoff_types::Seed;
use latency::Latency;
use observation::{OBSERVATION_WITH_OPPONENT_LEN, observe, wrap};

/// The communication channel between one agent and its robot, for one episode, or one rally of a game. It adds noise to the
/// observations and delays the commands, as a Gymnasium wrapper would.
#[derive(Debug, Clone)]
pub struct AgentChannel {
    robot: usize,
    interpolation: Interpolation,
    noise: Option<ObservationNoise>,
    latency: Option<Latency>,
    observation: [f64; OBSERVATION_WITH_OPPONENT_LEN],
}

impl AgentChannel {
    /// The channel of a robot (0 or 1) in a world at its start. Each perturbation and each robot has its own random stream,
    /// derived from `seed` by the perturbation's name.
    #[must_use]
    pub fn new(
        robot: usize,
        interpolation: Interpolation,
        active_perturbations: ActivePerturbations,
        settings: &PerturbationSettings,
        seed: &Seed,
        world: &World,
    ) -> Self {
        let stream = |perturbation: Perturbation| {
            active_perturbations
                .contains(perturbation)
                .then(|| match robot {
                    0 => RandomStream::new(seed, perturbation.as_str()),
                    _ => RandomStream::new(seed, &format!("{perturbation}, robot {}", robot + 1)),
                })
        };
        let mut channel = Self {
            robot,
            interpolation,
            noise: stream(Perturbation::ObservationNoise)
                .map(|stream| ObservationNoise::new(&settings.observation_noise, stream)),
            latency: stream(Perturbation::Delay)
                .map(|stream| Latency::new(&settings.delay, interpolation, stream)),
            observation: [0.0; OBSERVATION_WITH_OPPONENT_LEN],
        };
        channel.update_observation(world, false);
        channel
    }

    /// The latest observation. Its last three numbers are the position of the opponent's end effector, or zero without an opponent.
    #[must_use]
    pub fn observation(&self) -> &[f64; OBSERVATION_WITH_OPPONENT_LEN] {
        &self.observation
    }

    /// Sets the interpolation of later actions.
    pub fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
        if let Some(latency) = &mut self.latency {
            latency.set_interpolation(interpolation);
        }
    }

    /// Passes the command for the coming control step to the robot.
    pub fn command(&mut self, world: &mut World, command: Command<'_>) {
        let (robot, interpolation) = (self.robot, self.interpolation);
        if let Command::Act(action) = command {
            debug_assert_eq!(action.len(), interpolation.len());
        }
        match (&mut self.latency, command) {
            (Some(latency), command) => latency.command(world, robot, command),
            (None, Command::Act(action)) => world.command(robot, interpolation, action),
            (None, Command::Late) => world.hold(robot, interpolation),
        }
    }

    /// Observes the world. If tracking has lost the puck, the observation repeats its last reported pose, at rest.
    pub fn update_observation(&mut self, world: &World, is_puck_lost: bool) {
        let [x, y, yaw, ..] = self.observation;
        self.observation = observe(world, self.robot);
        if let Some(latency) = &mut self.latency {
            latency.delay(&mut self.observation);
        }
        // Draw noise for a lost puck too, so that a loss does not shift later draws.
        if let Some(noise) = &mut self.noise {
            noise.add(&mut self.observation);
            self.observation[2] = wrap(self.observation[2]);
        }
        if is_puck_lost {
            self.observation[..6].copy_from_slice(&[x, y, yaw, 0.0, 0.0, 0.0]);
        }
    }
}

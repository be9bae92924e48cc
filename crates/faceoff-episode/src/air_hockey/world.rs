//! The world of an episode of a qualifying task.

use crate::{
    air_hockey::arena::Arena,
    world::{Environment, World},
};
use faceoff_sim::{ConstraintValues, EPISODE_STEPS, Episode, EpisodeState, Impact};
use faceoff_types::{EpisodeEnd, Interpolation, Seed, Task, UnknownTask, Violations};

/// An episode of the simulator, with its state after the last step.
#[derive(Debug, Clone)]
pub struct AirHockeyWorld {
    simulation: Episode,
    state: EpisodeState,
    constraints: ConstraintValues,
}

/// What recordings have of a step beside observation, action and times.
#[derive(Debug, Clone, Copy)]
pub struct AirHockeyStep<'a> {
    /// The true state after the step.
    pub state: &'a EpisodeState,
    /// Constraint values after the step; a constraint is violated if its value is above 0.
    pub constraints: ConstraintValues,
    /// Had the (simulated) puck tracking lost the puck after the step? Then the observation repeats an earlier pose.
    pub puck_lost: bool,
    /// Contacts of the puck that began in the step.
    pub impacts: &'a [Impact],
}

impl AirHockeyWorld {
    fn new(simulation: Episode) -> Self {
        Self {
            state: simulation.state(),
            constraints: simulation.constraints(),
            simulation,
        }
    }
}

impl World for AirHockeyWorld {
    type Choice = Interpolation;
    type Start<'a> = &'a EpisodeState;
    type Step<'a> = AirHockeyStep<'a>;

    fn steps(&self) -> u32 {
        self.simulation.steps()
    }

    fn observation(&self) -> &[f64] {
        self.simulation.observation()
    }

    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd> {
        let outcome = self.simulation.step(action);
        self.constraints = outcome.constraints;
        self.state = self.simulation.state();
        outcome.end
    }

    fn divergence(&self) -> Option<String> {
        let divergence = self.simulation.divergence();
        divergence.map(|divergence| divergence.cause.to_string())
    }

    fn success(&self) -> bool {
        self.simulation.success()
    }

    fn violations(&self) -> Violations {
        self.simulation.violations()
    }

    fn start(&self) -> &EpisodeState {
        &self.state
    }

    fn last_step(&self) -> AirHockeyStep<'_> {
        AirHockeyStep {
            state: &self.state,
            constraints: self.constraints,
            puck_lost: self.simulation.is_puck_lost(),
            impacts: self.simulation.world().impacts(),
        }
    }
}

impl Environment for Arena {
    type World = AirHockeyWorld;

    fn seed(&self, task: Task, index: u32) -> Seed {
        self.episode_seed(task, index)
    }

    fn max_steps(&self, _: Task) -> u32 {
        EPISODE_STEPS
    }

    fn reset(
        &self,
        task: Task,
        index: u32,
        choice: Option<Interpolation>,
    ) -> Result<AirHockeyWorld, UnknownTask> {
        let interpolation = choice.unwrap_or(Interpolation::Cubic);
        let simulation = self.episode(task.try_into()?, index, interpolation);
        Ok(AirHockeyWorld::new(simulation))
    }
}

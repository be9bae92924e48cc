//! The world of an episode of a task: hit, defend or prepare.

use crate::simulation_setup::SimulationSetup;
use faceoff_episode::{StateColumns, World, WorldFactory};
use faceoff_sim::{ConstraintValues, EPISODE_STEPS, Episode, EpisodeState, Impact, Interpolation};
use faceoff_types::{ActionLayout, EpisodeEnd, Seed, Task, UnknownTask, Violations};
use std::any::Any;

/// An episode of the simulator, with its state after the last step.
#[derive(Debug, Clone)]
pub struct AirHockeyWorld {
    simulation: Episode,
    state: EpisodeState,
    constraints: ConstraintValues,
    /// The constraint values in the order of the recordings' columns.
    constraint_values: [f64; 4],
}

impl AirHockeyWorld {
    fn new(simulation: Episode) -> Self {
        let constraints = simulation.constraints();
        Self {
            state: simulation.state(),
            constraints,
            constraint_values: constraint_values(&constraints),
            simulation,
        }
    }

    /// The true state now.
    #[must_use]
    pub const fn state(&self) -> &EpisodeState {
        &self.state
    }

    /// Constraint values now; a constraint is violated if its value is above 0.
    #[must_use]
    pub const fn constraints(&self) -> &ConstraintValues {
        &self.constraints
    }

    /// Has the (simulated) puck tracking lost the puck? Then the observation repeats an earlier pose.
    #[must_use]
    pub fn is_puck_lost(&self) -> bool {
        self.simulation.is_puck_lost()
    }

    /// Contacts of the puck that began in the last step.
    #[must_use]
    pub fn impacts(&self) -> &[Impact] {
        self.simulation.world().impacts()
    }
}

/// In the order of the recordings' columns.
const fn constraint_values(constraints: &ConstraintValues) -> [f64; 4] {
    [
        constraints.joint_pos,
        constraints.joint_vel,
        constraints.ee,
        constraints.link,
    ]
}

impl World for AirHockeyWorld {
    fn steps(&self) -> u32 {
        self.simulation.steps()
    }

    fn observation(&self) -> &[f64] {
        self.simulation.observation()
    }

    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd> {
        let outcome = self.simulation.step(action);
        self.constraints = outcome.constraints;
        self.constraint_values = constraint_values(&outcome.constraints);
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
        self.simulation.violations().into()
    }

    fn record_state(&self, columns: &mut dyn StateColumns) {
        record_state(&self.state, columns);
    }

    fn constraint_values(&self) -> &[f64] {
        &self.constraint_values
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// Writes the columns of a state.
fn record_state(state: &EpisodeState, columns: &mut dyn StateColumns) {
    let EpisodeState {
        puck,
        q,
        dq,
        dq_filtered: _,
        universal,
        ee,
        opponent_q,
        opponent_ee,
    } = state;
    columns.put(puck);
    columns.put(q);
    columns.put(dq);
    columns.put(universal);
    columns.put(ee);
    put_optional(columns, opponent_q.as_ref());
    put_optional(columns, opponent_ee.as_ref());
}

fn put_optional<const N: usize>(columns: &mut dyn StateColumns, values: Option<&[f64; N]>) {
    match values {
        Some(values) => columns.put(values),
        None => columns.put_absent(N),
    }
}

impl WorldFactory for SimulationSetup {
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
        layout: Option<ActionLayout>,
    ) -> Result<Box<dyn World>, UnknownTask> {
        // Without a layout no step follows.
        let interpolation = layout.and_then(|layout| Interpolation::from_code(layout.code()).ok());
        let interpolation = interpolation.unwrap_or(Interpolation::Cubic);
        let simulation = self.episode(task.try_into()?, index, interpolation);
        Ok(Box::new(AirHockeyWorld::new(simulation)))
    }
}

//! *Episodes*: attempts of one agent at one of the tasks (`hit`, `defend`, `prepare`), in control steps of 20 ms.

mod air_hockey_task;
pub mod constraints;
pub mod ends;
pub mod env_info;
pub mod opponent;
pub mod task;

pub use air_hockey_task::AirHockeyTask;
pub use task::EPISODE_STEPS;

use crate::{
    ActivePerturbations,
    channel::{AgentChannel, Command, observation},
    model::JOINTS,
    perturbation::table_perturbations::TablePerturbations,
    robot::plant::Plant,
    stream::RandomStream,
    table::puck::Puck,
    world::{Bounds, Divergence, World},
};
use crate::{Interpolation, PerturbationSettings};
use constraints::{ConstraintValues, ViolatedConstraints};
use faceoff_types::{EpisodeEnd, Seed};
use opponent::Opponent;

/// A running episode. It is deterministic: it reads no clock and does no I/O. A clone continues with the same bits.
#[derive(Debug, Clone)]
pub struct Episode {
    task: AirHockeyTask,
    world: World,
    opponent: Option<Opponent>,
    channel: AgentChannel,
    table: TablePerturbations,
    /// Control steps so far.
    steps: u32,
    /// Whether the (simulated) tracking has lost the puck.
    puck_lost: bool,
    /// Constraints violated so far.
    violations: ViolatedConstraints,
}

impl Episode {
    /// An episode at its start. `settings` are the magnitudes of the perturbations. `plant` (the arms' physical properties) is nominal
    /// unless the active perturbations contain [`ModelMismatch`](crate::Perturbation::ModelMismatch); then the caller passes
    /// [`Plant::mismatched`]. The initial state and each perturbation have their own random stream, derived from `seed` by name.
    #[must_use]
    pub fn new(
        task: AirHockeyTask,
        interpolation: Interpolation,
        active_perturbations: ActivePerturbations,
        settings: &PerturbationSettings,
        plant: &Plant,
        seed: Seed,
    ) -> Self {
        let puck = task::initial_puck(task, &mut RandomStream::new(&seed, "initial_state"));
        Self::with_initial_puck(
            task,
            interpolation,
            active_perturbations,
            settings,
            plant,
            seed,
            puck,
        )
    }

    /// As [`Episode::new`], with a given initial state of the puck: [x, y, yaw, vx, vy, yaw rate], table frame.
    #[must_use]
    pub fn with_initial_puck(
        task: AirHockeyTask,
        interpolation: Interpolation,
        active_perturbations: ActivePerturbations,
        settings: &PerturbationSettings,
        plant: &Plant,
        seed: Seed,
        puck: [f64; 6],
    ) -> Self {
        let opponent = (task == AirHockeyTask::Hit).then(Opponent::new);
        let mut world = World::with_robots(plant, if opponent.is_some() { 2 } else { 1 }, puck);
        let table = TablePerturbations::new(active_perturbations, settings, &seed, &mut world);
        Self {
            task,
            channel: AgentChannel::new(
                0,
                interpolation,
                active_perturbations,
                settings,
                &seed,
                &world,
            ),
            world,
            opponent,
            table,
            steps: 0,
            puck_lost: false,
            violations: ViolatedConstraints::default(),
        }
    }

    /// The same episode with other bounds of the simulation than those of the current ruleset.
    #[must_use]
    pub fn with_bounds(mut self, bounds: Bounds) -> Self {
        self.world.set_bounds(bounds);
        self
    }

    /// The observation for the agent: 23 numbers for `hit`, 20 otherwise (`docs/protocol.md`, "Observations").
    #[must_use]
    pub fn observation(&self) -> &[f64] {
        &self.channel.observation()[..observation::len(self.task)]
    }

    /// One control step. `action` is row-major, of length [`Interpolation::len`], finite. Must not
    /// be called after an end. If the world diverges (its state would leave the bounds of the simulation), the episode ends with
    /// [`EpisodeEnd::AGENT_FAULT`], since only the agent's commands can cause it.
    pub fn step(&mut self, action: &[f64]) -> StepOutcome {
        self.command(action);
        let (world, air_force) = self.world_and_air_force();
        world.control_step(air_force);
        self.observe()
    }

    /// Starts a control step: sets the commands of all robots.
    pub(crate) fn command(&mut self, action: &[f64]) {
        self.channel.command(&mut self.world, Command::Act(action));
        if let Some(opponent) = &mut self.opponent {
            self.world.command(
                1,
                Interpolation::LinearPositionAndVelocity,
                &opponent.action(),
            );
        }
    }

    /// The world to be stepped, and the function that returns the force of the air flow on the puck, N.
    pub(crate) fn world_and_air_force(&mut self) -> (&mut World, impl FnMut(&Puck) -> [f64; 2]) {
        let table = &mut self.table;
        (&mut self.world, |puck: &Puck| table.force(puck))
    }

    /// Ends a control step: updates the observation and returns the result.
    pub(crate) fn observe(&mut self) -> StepOutcome {
        self.puck_lost = self.table.draw_puck_lost();
        self.channel.update_observation(&self.world, self.puck_lost);
        self.steps += 1;

        let constraints = self.constraints();
        constraints.mark(&mut self.violations);
        let end = match self.divergence() {
            Some(_) => Some(EpisodeEnd::AGENT_FAULT),
            None => task::end(self.task, self.world.puck(), self.steps),
        };
        StepOutcome { end, constraints }
    }

    /// `Some` once the world has diverged; its numbers are still finite then.
    #[must_use]
    pub fn divergence(&self) -> Option<Divergence> {
        self.world.divergence()
    }

    /// Has the (simulated) tracking lost the puck, so that the observation repeats an earlier pose?
    #[must_use]
    pub fn is_puck_lost(&self) -> bool {
        self.puck_lost
    }

    /// Control steps so far.
    #[must_use]
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Is the last true state a success of the task?
    #[must_use]
    pub fn success(&self) -> bool {
        task::success(self.task, self.world.puck())
    }

    /// Constraints violated so far.
    #[must_use]
    pub fn violations(&self) -> ViolatedConstraints {
        self.violations
    }

    /// Constraint values of the agent's robot now.
    #[must_use]
    pub fn constraints(&self) -> ConstraintValues {
        ConstraintValues::of(&self.world, 0)
    }

    /// True state after the last step, or the initial one.
    #[must_use]
    pub fn state(&self) -> EpisodeState {
        let world = &self.world;
        let ee = |robot: usize| world.kinematics(robot).end_effector.origin.to_array();
        let has_opponent = self.opponent.is_some();
        EpisodeState {
            puck: world.puck().state(),
            q: world.joints(0),
            dq: world.joint_velocities(0),
            dq_filtered: *world.filtered_velocities(0),
            universal: world.universal(0),
            ee: ee(0),
            opponent_q: has_opponent.then(|| world.joints(1)),
            opponent_ee: has_opponent.then(|| ee(1)),
        }
    }

    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }
}

/// Result of a control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOutcome {
    /// The end of the episode, if this step ended it.
    pub end: Option<EpisodeEnd>,
    /// Constraint values after this step.
    pub constraints: ConstraintValues,
}

impl StepOutcome {
    /// The value before the first step.
    pub(crate) const NONE: Self = Self {
        end: None,
        constraints: ConstraintValues::ZERO,
    };
}

/// The true state of an episode, as recordings contain it. SI units, radians. Joints are those of the agent's robot.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeState {
    /// The puck's x, y, yaw, vx, vy, yaw rate, in the table frame.
    pub puck: [f64; 6],
    /// Positions of the driven joints.
    pub q: [f64; JOINTS],
    /// Velocities of the driven joints.
    pub dq: [f64; JOINTS],
    /// Low-pass filtered velocities of the driven joints.
    pub dq_filtered: [f64; JOINTS],
    /// Angles of the universal joint, the two hinges of the mallet.
    pub universal: [f64; 2],
    /// Position of the end effector, in the robot's own base frame.
    pub ee: [f64; 3],
    /// Joint positions of the opponent, `hit` only.
    pub opponent_q: Option<[f64; JOINTS]>,
    /// Position of the opponent's end effector in its own base frame, `hit` only.
    pub opponent_ee: Option<[f64; 3]>,
}

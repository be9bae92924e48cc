//! The traits of simulated worlds. An episode is played against them, so that it is the same for every competition.

use faceoff_types::{
    ActionLayout, AgentTask, Competition, EpisodeEnd, Magnitudes, Profile, Ruleset, Seed, Task,
    UnknownProfile, UnknownTask, Violations,
};
use std::{any::Any, fmt, sync::Arc};

/// A simulated world in which an agent attempts a task, control step by control step. The same seed and actions give the same
/// bits.
pub trait World: Send + Sync {
    /// Control steps so far.
    fn steps(&self) -> u32;
    /// The observation for the agent, of the same length in all steps.
    fn observation(&self) -> &[f64];
    /// Simulates one control step. `action` is finite, and has the length of the layout that the agent has chosen. Returns the end of
    /// the episode, if this step is its last. Must not be called after an end.
    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd>;
    /// Why the world has left the bounds of the simulation, if it has: the agent's fault.
    fn divergence(&self) -> Option<String>;
    /// Is the present state a success of the task?
    fn success(&self) -> bool;
    /// For each kind of violation of the competition, in the order of [`Competition::violations`]: whether it has happened so far.
    fn violations(&self) -> Violations;
    /// Writes the present true state, in the order of the competition's columns
    /// ([`RecordingColumns::state`](faceoff_types::RecordingColumns::state)).
    fn record_state(&self, columns: &mut dyn StateColumns);
    /// The value of each constraint after the last step: by how much its limit is exceeded. They are in the order of
    /// [`RecordingColumns::limits`](faceoff_types::RecordingColumns::limits). A constraint is violated if its value is above 0.
    fn constraint_values(&self) -> &[f64];
    /// The world itself, for receivers of steps ([`StepSink`](crate::StepSink)) that know its type.
    fn as_any(&self) -> &dyn Any;
}

/// Receives the values of the columns of a state, from left to right.
pub trait StateColumns {
    /// The values of the next columns.
    fn put(&mut self, values: &[f64]);
    /// The next `count` columns have no value.
    fn put_absent(&mut self, count: usize);
}

/// Makes the world of each episode of an evaluation, from the conditions that all its episodes have in common.
pub trait WorldFactory: Send + Sync {
    /// The seed of an episode; `index` is its index within the evaluation.
    fn seed(&self, task: Task, index: u32) -> Seed;
    /// Control steps of the longest episode of a task.
    fn max_steps(&self, task: Task) -> u32;
    /// The world of an episode at its start. `layout` is `None` if the agent failed before it stated one; then no step follows.
    ///
    /// # Errors
    /// If the factory has no such task.
    fn reset(
        &self,
        task: Task,
        index: u32,
        layout: Option<ActionLayout>,
    ) -> Result<Box<dyn World>, UnknownTask>;
}

/// The conditions under which the episodes of an evaluation are played.
#[derive(Debug, Clone, Copy)]
pub struct Conditions<'a> {
    pub ruleset: Ruleset,
    pub profile: Profile,
    /// Magnitudes of the profile's perturbations.
    pub perturbations: &'a Magnitudes,
    /// The seed from which the seeds of the episodes are derived.
    pub seed: Seed,
    /// The seed of the season's model mismatch: how the simulated robot deviates from the nominal model that agents know.
    pub mismatch_seed: Seed,
}

/// Conditions that a simulator does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidConditions {
    #[error("the simulator does not have the ruleset {0}")]
    Ruleset(Ruleset),
    #[error(transparent)]
    Profile(#[from] UnknownProfile),
    /// Why the magnitudes are invalid.
    #[error("perturbations: {0}")]
    Magnitudes(String),
}

/// A competition with its simulator. Workers run episodes with it, and verification replays recorded ones.
pub trait Simulator: fmt::Debug + Send + Sync {
    fn competition(&self) -> &Arc<Competition>;
    /// A hash of what the simulator computes, as 64 hexadecimal digits: recordings of a simulator with another one cannot be verified.
    fn fingerprint(&self) -> &str;
    /// The field `env` of the message `hello`, as JSON on one line: the constants of the task for its agents.
    ///
    /// # Errors
    /// If the simulator has no such task.
    fn hello_env(&self, agent_task: AgentTask) -> Result<String, UnknownTask>;
    /// The factory of the worlds of an evaluation. Making it may take milliseconds, so use one factory for many episodes.
    ///
    /// # Errors
    /// If the simulator has no such ruleset, profile or magnitudes.
    fn world_factory(
        &self,
        conditions: &Conditions<'_>,
    ) -> Result<Box<dyn WorldFactory>, InvalidConditions>;
    /// Checks that the simulator can draw a season with this mismatch seed and these magnitudes, each of which is already known to be
    /// in its range ([`Competition::check_magnitudes`]). It may take a second.
    ///
    /// # Errors
    /// The reason, which begins with the name of the group of magnitudes.
    fn check_season_magnitudes(
        &self,
        magnitudes: &Magnitudes,
        mismatch_seed: Seed,
    ) -> Result<(), String> {
        let _ = (magnitudes, mismatch_seed);
        Ok(())
    }
}

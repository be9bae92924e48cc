//! The traits of simulated worlds. An episode is played against them, so that it is the same for every competition.

use faceoff_types::{EpisodeEnd, Seed, Task, UnknownTask, Violations};

/// A simulated world in which an agent attempts a task, control step by control step. The same seed and actions give the same
/// bits.
pub trait World {
    /// What an agent chooses before its first action, such as the layout of its actions.
    type Choice: Copy;
    /// The initial state, as recordings have it.
    type Start<'a>: Copy
    where
        Self: 'a;
    /// What recordings have of a step beside observation, action and times.
    type Step<'a>: Copy
    where
        Self: 'a;

    /// Control steps so far.
    fn steps(&self) -> u32;
    /// The observation for the agent, of the same length in all steps.
    fn observation(&self) -> &[f64];
    /// Simulates one control step. `action` is finite, and has the length that the agent has chosen. Returns the end of the episode, if
    /// this step is its last. Must not be called after an end.
    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd>;
    /// Why the world has left the bounds of the simulation, if it has: the agent's fault.
    fn divergence(&self) -> Option<String>;
    /// Is the present state a success of the task?
    fn success(&self) -> bool;
    /// Constraints violated so far.
    fn violations(&self) -> Violations;
    /// The initial state; before the first step.
    fn start(&self) -> Self::Start<'_>;
    /// The last step.
    fn last_step(&self) -> Self::Step<'_>;
}

/// What all episodes of an evaluation have in common. It makes the world of each episode.
pub trait Environment {
    /// The world of an episode.
    type World: World;

    /// The seed of an episode; `index` is its index within the evaluation.
    fn seed(&self, task: Task, index: u32) -> Seed;
    /// Control steps of the longest episode of a task.
    fn max_steps(&self, task: Task) -> u32;
    /// The world of an episode at its start. `choice` is `None` if the agent failed before it stated one; then no step follows.
    ///
    /// # Errors
    /// If the environment has no such task.
    fn reset(
        &self,
        task: Task,
        index: u32,
        choice: Option<<Self::World as World>::Choice>,
    ) -> Result<Self::World, UnknownTask>;
}

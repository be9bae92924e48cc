//! Rows of the recording of an episode (one attempt of an agent at a task), and the trait of their receivers. In an *evaluation* one agent
//! plays many episodes of each task.

use crate::world::World;
use faceoff_types::{EpisodeOutcome, Seed};

/// Measured times of one answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnswerTiming {
    /// Computation time in seconds: wall time from the first attempt to write the observation to the last byte of the answer,
    /// minus host interference.
    pub computation_time_s: f64,
    /// Part of the wall time due to host interference (other load on the machine), in seconds.
    pub host_time_s: f64,
    /// CPU time of the agent's process tree during the wall time, in seconds, if the host reports it.
    pub cpu_time_s: Option<f64>,
}

/// The start of an episode.
#[derive(Debug, Clone, Copy)]
pub struct EpisodeStart<'a, W: World + 'a> {
    /// Index within the evaluation.
    pub episode: u32,
    /// The episode's own seed.
    pub seed: Seed,
    /// What the agent has chosen; `None` if it failed before it stated that.
    pub choice: Option<W::Choice>,
    /// The true initial state.
    pub state: W::Start<'a>,
}

/// An answered control step. Its observation was passed to [`StepSink::observe`] before.
#[derive(Debug, Clone, Copy)]
pub struct StepRow<'a, W: World + 'a> {
    /// The control step, from 0.
    pub step: u32,
    /// The agent's action, row-major.
    pub action: &'a [f64],
    /// Times of the answer.
    pub timing: AnswerTiming,
    /// The observation after the step.
    pub next_observation: &'a [f64],
    /// What else is recorded of the step.
    pub world: W::Step<'a>,
}

/// A failure to write a recording; never an agent fault.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct RecordError {
    /// What could not be written, e.g. a file's name.
    pub what: String,
    pub source: Box<dyn std::error::Error + Send + Sync>,
}

/// Receives the start, the steps and the end of episodes in a kind of world, e.g. to record them.
pub trait StepSink<W: World> {
    /// Starts an episode. If the previous episode has not ended, its recording is discarded, since the caller repeats it.
    fn begin(&mut self, start: EpisodeStart<'_, W>);
    /// The observation for the agent, before the step.
    fn observe(&mut self, observation: &[f64]);
    /// The step after the observation.
    fn step(&mut self, row: &StepRow<'_, W>);
    /// Ends the episode. `host_noise_reruns` is the number of earlier tries that were discarded because of host interference.
    ///
    /// # Errors
    /// If the recording could not be written.
    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError>;
}

impl<W: World, S: StepSink<W> + ?Sized> StepSink<W> for &mut S {
    fn begin(&mut self, start: EpisodeStart<'_, W>) {
        (**self).begin(start);
    }
    fn observe(&mut self, observation: &[f64]) {
        (**self).observe(observation);
    }
    fn step(&mut self, row: &StepRow<'_, W>) {
        (**self).step(row);
    }
    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError> {
        (**self).end(outcome, host_noise_reruns)
    }
}

/// Discards everything.
#[derive(Debug, Clone, Copy)]
pub struct NullSink;

impl<W: World> StepSink<W> for NullSink {
    fn begin(&mut self, _: EpisodeStart<'_, W>) {}
    fn observe(&mut self, _: &[f64]) {}
    fn step(&mut self, _: &StepRow<'_, W>) {}
    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        Ok(())
    }
}

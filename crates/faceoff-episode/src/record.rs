//! Rows of the recording of an episode (one attempt of an agent at a task), and the trait of their receivers. In an *evaluation* one agent
//! plays many episodes of each task.

use crate::world::World;
use faceoff_types::{ActionLayout, EpisodeOutcome, Seed};

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
#[derive(Clone, Copy)]
pub struct EpisodeStart<'a> {
    /// Index within the evaluation.
    pub episode: u32,
    /// The episode's own seed.
    pub seed: Seed,
    /// The layout of the agent's actions; `None` if it failed before it stated one.
    pub layout: Option<ActionLayout>,
    /// The world in its initial state.
    pub world: &'a dyn World,
}

/// An answered control step. Its observation was passed to [`StepSink::observe`] before.
#[derive(Clone, Copy)]
pub struct StepRow<'a> {
    /// The control step, from 0.
    pub step: u32,
    /// The agent's action, row-major.
    pub action: &'a [f64],
    /// Times of the answer.
    pub timing: AnswerTiming,
    /// The observation after the step.
    pub next_observation: &'a [f64],
    /// The world after the step.
    pub world: &'a dyn World,
}

/// A failure to write a recording; never an agent fault.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct RecordError {
    /// What could not be written, e.g. a file's name.
    pub what: String,
    pub source: Box<dyn std::error::Error + Send + Sync>,
}

/// A *sink*: it receives the start, the steps and the end of episodes, to record them, to compare them with a recording, or to count them.
pub trait StepSink {
    /// Starts an episode. If the previous episode has not ended, its recording is discarded, since the caller repeats it.
    fn begin(&mut self, start: EpisodeStart<'_>);
    /// The observation for the agent, before the step.
    fn observe(&mut self, observation: &[f64]);
    /// The step after the observation.
    fn step(&mut self, row: &StepRow<'_>);
    /// Ends the episode. `host_interference_reruns` is the number of earlier tries that were discarded because of host interference.
    ///
    /// # Errors
    /// If the recording could not be written.
    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordError>;
}

impl<S: StepSink + ?Sized> StepSink for &mut S {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        (**self).begin(start);
    }
    fn observe(&mut self, observation: &[f64]) {
        (**self).observe(observation);
    }
    fn step(&mut self, row: &StepRow<'_>) {
        (**self).step(row);
    }
    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordError> {
        (**self).end(outcome, host_interference_reruns)
    }
}

/// Discards everything.
#[derive(Debug, Clone, Copy)]
pub struct NullSink;

impl StepSink for NullSink {
    fn begin(&mut self, _: EpisodeStart<'_>) {}
    fn observe(&mut self, _: &[f64]) {}
    fn step(&mut self, _: &StepRow<'_>) {}
    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        Ok(())
    }
}

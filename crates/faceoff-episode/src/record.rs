//! What is recorded of an episode, and where it goes.

use faceoff_sim::{ConstraintValues, EpisodeState, Impact};
use faceoff_types::{EpisodeOutcome, Interpolation, Seed};

/// The measurements of one answered step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answered {
    /// What counts: wall time from the first attempt to write the question to the last byte of the answer
    /// read, less what the host took, in seconds.
    pub computation_time_s: f64,
    /// What the host took of the wall time, in seconds.
    pub host_time_s: f64,
    /// CPU time that the agent's process tree used meanwhile, in seconds, where the host tells.
    pub cpu_time_s: Option<f64>,
}

/// How an episode begins.
#[derive(Debug, Clone, Copy)]
pub struct EpisodeStart<'a> {
    /// Index within the evaluation.
    pub episode: u32,
    /// The episode's own seed.
    pub seed: Seed,
    /// `None` when the agent did not get as far as to say.
    pub interpolation: Option<Interpolation>,
    /// The true initial state.
    pub state: &'a EpisodeState,
}

/// One answered control step; the observation was given before.
#[derive(Debug, Clone, Copy)]
pub struct StepRow<'a> {
    /// The control step, from 0.
    pub step: u32,
    /// The agent's action, row-major.
    pub action: &'a [f64],
    /// How long the answer took.
    pub answered: Answered,
    /// The true state after the step.
    pub state: &'a EpisodeState,
    /// The constraints at that state; violated when above 0.
    pub constraints: ConstraintValues,
    /// The observation after the step.
    pub next_observation: &'a [f64],
    /// Had tracking lost the puck after the step? Its observation then repeats an earlier place.
    pub puck_lost: bool,
    /// The contacts of the puck that began in the step.
    pub impacts: &'a [Impact],
}

/// A recording that could not be written; never the agent's fault.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct RecordError {
    pub what: String,
    pub source: Box<dyn std::error::Error + Send + Sync>,
}

/// Where an episode's course goes.
pub trait StepSink {
    /// Begins an episode. What was begun before and has not ended is dropped: it is played again.
    fn begin(&mut self, start: EpisodeStart<'_>);
    /// The observation that the agent was given, before the step.
    fn observe(&mut self, observation: &[f64]);
    /// The step that followed.
    fn step(&mut self, row: &StepRow<'_>);
    /// Ends it; `host_noise_reruns` tries were dropped before this one.
    ///
    /// # Errors
    /// The recording could not be written.
    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError>;
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
    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError> {
        (**self).end(outcome, host_noise_reruns)
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Nowhere;

impl StepSink for Nowhere {
    fn begin(&mut self, _: EpisodeStart<'_>) {}
    fn observe(&mut self, _: &[f64]) {}
    fn step(&mut self, _: &StepRow<'_>) {}
    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        Ok(())
    }
}

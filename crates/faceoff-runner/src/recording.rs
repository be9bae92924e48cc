//! The recording of a shard: two Parquet tables, the report and the log, written as the shard runs.

mod columns;
mod digest;
mod episodes;
mod folder;
mod parquet_file;
mod steps;

use crate::{PlatformFault, session::Answered};
use faceoff_sim::{ConstraintValues, EpisodeState};
use faceoff_types::{EpisodeOutcome, Seed, Task};
use faceoff_wire::InterpolationCode;

pub(crate) use digest::HashingWriter;
pub(crate) use folder::{ShardFolder, ShardRecording};
pub(crate) use parquet_file::join;
pub(crate) use steps::{StepScan, scan_steps};

use episodes::EpisodesTable;
use steps::StepsTable;

/// How an episode begins.
pub(crate) struct EpisodeStart<'a> {
    pub episode: u32,
    pub seed: Seed,
    /// `None` when the agent did not get as far as to say.
    pub interpolation: Option<InterpolationCode>,
    pub state: &'a EpisodeState,
}

/// One answered control step; the observation was given before.
pub(crate) struct StepRow<'a> {
    pub step: u32,
    pub action: &'a [f64],
    pub answered: Answered,
    /// The true state after the step.
    pub state: &'a EpisodeState,
    pub constraints: ConstraintValues,
}

/// Where an episode's course goes.
pub(crate) trait StepSink {
    /// Begins an episode. What was begun before and has not ended is dropped: it is played again.
    fn begin(&mut self, start: EpisodeStart<'_>);
    /// The observation that the agent was given, before the step.
    fn observe(&mut self, observation: &[f64]);
    fn step(&mut self, row: &StepRow<'_>);
    /// Ends it; `host_noise_reruns` tries were dropped before this one.
    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_noise_reruns: u32,
    ) -> Result<(), PlatformFault>;
}

/// Records nothing.
pub(crate) struct Nowhere;

impl StepSink for Nowhere {
    fn begin(&mut self, _: EpisodeStart<'_>) {}
    fn observe(&mut self, _: &[f64]) {}
    fn step(&mut self, _: &StepRow<'_>) {}
    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), PlatformFault> {
        Ok(())
    }
}

/// Writes both tables. Memory is bounded by one episode and one row group, whatever the shard's
/// size.
pub(crate) struct Recorder {
    steps: StepsTable,
    episodes: EpisodesTable,
}

impl Recorder {
    /// Opens both tables in the folder, under temporary names.
    pub fn create(folder: &ShardFolder, task: Task) -> Result<Self, PlatformFault> {
        Ok(Self {
            steps: StepsTable::create(&folder.partial(STEPS_FILE), task)?,
            episodes: EpisodesTable::create(&folder.partial(EPISODES_FILE))?,
        })
    }

    /// Writes what is left and closes both tables.
    pub fn finish(self) -> Result<(), PlatformFault> {
        self.steps.finish()?;
        self.episodes.finish()
    }
}

impl StepSink for Recorder {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.steps.begin(start.episode);
        self.episodes.begin(&start);
    }

    fn observe(&mut self, observation: &[f64]) {
        self.steps.observe(observation);
    }

    fn step(&mut self, row: &StepRow<'_>) {
        self.steps.push(row);
    }

    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_noise_reruns: u32,
    ) -> Result<(), PlatformFault> {
        self.steps.flush()?;
        self.episodes.end(outcome, host_noise_reruns)
    }
}

/// The table of control steps.
pub(crate) const STEPS_FILE: &str = "steps.parquet";
/// The table of episodes.
pub(crate) const EPISODES_FILE: &str = "episodes.parquet";
/// The agent's log.
pub(crate) const LOG_FILE: &str = "agent.log";

//! The recording of a shard: two Parquet tables, the report and the log, written as the shard runs.

mod columns;
pub(crate) mod digest;
mod episodes;
mod folder;
mod parquet_file;
mod steps;
mod times;

use crate::{PlatformFault, session::Answered};
use faceoff_sim::{ConstraintValues, EpisodeState};
use faceoff_types::{EpisodeOutcome, Seed, Task};
use faceoff_wire::InterpolationCode;

pub(crate) use digest::HashingWriter;
pub(crate) use episodes::{EpisodeRows, end_name};
pub(crate) use folder::{ShardFolder, ShardRecording};
pub(crate) use parquet_file::join;
pub(crate) use steps::{StepRows, StepScan, scan_steps};
pub(crate) use times::seconds;

use parquet_file::TableWriter;

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
    /// The observation after the step.
    pub next_observation: &'a [f64],
}

/// Where an episode's course goes.
pub(crate) trait StepSink {
    fn begin(&mut self, start: EpisodeStart<'_>);
    /// The observation that the agent was given, before the step.
    fn observe(&mut self, observation: &[f64]);
    fn step(&mut self, row: &StepRow<'_>);
    fn end(&mut self, outcome: &EpisodeOutcome) -> Result<(), PlatformFault>;
}

/// Records nothing.
pub(crate) struct Nowhere;

impl StepSink for Nowhere {
    fn begin(&mut self, _: EpisodeStart<'_>) {}
    fn observe(&mut self, _: &[f64]) {}
    fn step(&mut self, _: &StepRow<'_>) {}
    fn end(&mut self, _: &EpisodeOutcome) -> Result<(), PlatformFault> {
        Ok(())
    }
}

/// Writes both tables. Memory is bounded by one episode and one row group, whatever the shard's
/// size.
pub(crate) struct Recorder {
    steps: StepRows,
    steps_file: TableWriter,
    episodes: EpisodeRows,
    episodes_file: TableWriter,
}

/// Episodes that are held before they go to the file.
const EPISODES_BATCH: usize = 256;

impl Recorder {
    /// Opens both tables in the folder, under temporary names.
    pub fn create(folder: &ShardFolder, task: Task) -> Result<Self, PlatformFault> {
        let (steps, episodes) = (StepRows::new(task), EpisodeRows::new());
        Ok(Self {
            steps_file: TableWriter::create(&folder.partial(STEPS_FILE), steps.schema())?,
            episodes_file: TableWriter::create(&folder.partial(EPISODES_FILE), episodes.schema())?,
            steps,
            episodes,
        })
    }

    /// Writes what is left and closes both tables.
    pub fn finish(mut self) -> Result<(), PlatformFault> {
        self.episodes_file.write(self.episodes.take())?;
        self.episodes_file.finish()?;
        self.steps_file.finish()
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
        self.episodes.step(row);
    }

    fn end(&mut self, outcome: &EpisodeOutcome) -> Result<(), PlatformFault> {
        self.steps_file.write(self.steps.take())?;
        self.episodes.end(outcome)?;
        if self.episodes.len() >= EPISODES_BATCH {
            self.episodes_file.write(self.episodes.take())?;
        }
        Ok(())
    }
}

/// The table of control steps.
pub(crate) const STEPS_FILE: &str = "steps.parquet";
/// The table of episodes.
pub(crate) const EPISODES_FILE: &str = "episodes.parquet";
/// Where constraints were broken.
pub(crate) const VIOLATIONS_FILE: &str = "violations.json";
/// The score.
pub(crate) const RESULTS_FILE: &str = "results.json";
/// What a dataset is, and the hashes of its other files.
pub(crate) const MANIFEST_FILE: &str = "manifest.json";
/// The agent's log.
pub(crate) const LOG_FILE: &str = "agent.log";

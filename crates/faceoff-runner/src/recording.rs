//! The recording of a shard: two Parquet tables, the report and the log, written as the shard runs.

mod columns;
pub(crate) mod digest;
mod episodes;
mod folder;
mod parquet_file;
mod steps;
mod times;

use crate::PlatformFault;
use faceoff_episode::{EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_types::{EpisodeOutcome, Task};

pub(crate) use digest::HashingWriter;
pub(crate) use episodes::{EpisodeRows, end_name};
pub(crate) use folder::{ShardFolder, ShardRecording};
pub(crate) use parquet_file::join;
pub(crate) use steps::{StepRows, StepScan, scan_steps};
pub(crate) use times::seconds;

use parquet_file::TableWriter;

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

    fn end_episode(
        &mut self,
        outcome: &EpisodeOutcome,
        host_noise_reruns: u32,
    ) -> Result<(), PlatformFault> {
        self.steps_file.write(self.steps.take())?;
        self.episodes.end(outcome, host_noise_reruns)?;
        if self.episodes.len() >= EPISODES_BATCH {
            self.episodes_file.write(self.episodes.take())?;
        }
        Ok(())
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

    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError> {
        self.end_episode(outcome, host_noise_reruns)
            .map_err(|fault| RecordError {
                what: "recording an episode".to_owned(),
                source: fault.into(),
            })
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
pub(crate) const CALIBRATION_FILE: &str = "calibration.json";
/// What a dataset is, and the hashes of its other files.
pub(crate) const MANIFEST_FILE: &str = "manifest.json";
/// The agent's log.
pub(crate) const LOG_FILE: &str = "agent.log";

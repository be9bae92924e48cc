use crate::{
    error::RecordingError,
    files::{EPISODES_FILE, STEPS_FILE},
    shard_folder::ShardFolder,
    table::{EpisodeRows, StepRows, TableWriter},
};
use faceoff_episode::{EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_types::{EpisodeOutcome, Task};

/// Writes both tables of a shard as it is played. Memory is bounded by one episode and one row group,
/// whatever the shard's size.
pub struct Recorder {
    steps: StepRows,
    steps_file: TableWriter,
    episodes: EpisodeRows,
    episodes_file: TableWriter,
}

/// Episodes that are held before they go to the file.
const EPISODES_BATCH: usize = 256;

impl Recorder {
    /// Opens both tables in the folder, under temporary names.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn create(folder: &ShardFolder, task: Task) -> Result<Self, RecordingError> {
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
    ) -> Result<(), RecordingError> {
        self.steps_file.write(self.steps.take())?;
        self.episodes.end(outcome, host_noise_reruns)?;
        if self.episodes.len() >= EPISODES_BATCH {
            self.episodes_file.write(self.episodes.take())?;
        }
        Ok(())
    }

    /// Writes what is left and closes both tables.
    ///
    /// # Errors
    /// [`RecordingError::Io`], or if the tables cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.episodes_file.write(self.episodes.take())?;
        self.episodes_file.finish()?;
        self.steps_file.finish()
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder")
            .field("episodes_held", &self.episodes.len())
            .finish_non_exhaustive()
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
            .map_err(|error| RecordError {
                what: "recording an episode".to_owned(),
                source: error.into(),
            })
    }
}

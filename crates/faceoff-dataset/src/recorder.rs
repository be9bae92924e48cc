//! Records a shard (a range of episodes of one task) while it is played: its tables, and the clips for replays (a clip is
//! a compact recording of one episode).

use crate::{
    error::RecordingError,
    files::{CLIPS_FILE, EPISODES_FILE, STEPS_FILE},
    shard_folder::ShardFolder,
    table::{EpisodeRows, StepRows, TableWriter},
};
use faceoff_episode::{EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_replay::ClipRecorder;
use faceoff_types::{Competition, EpisodeOutcome, Task};
use fs_err::File;
use std::{io::BufWriter, sync::Arc};

/// Writes the tables of control steps and of episodes, and the clips of a shard while it is played. Memory is bounded by one
/// episode and one row group.
pub struct Recorder {
    steps: StepRows,
    steps_file: TableWriter,
    episodes: EpisodeRows,
    episodes_file: TableWriter,
    clips: ClipRecorder<BufWriter<File>>,
}

/// Rows of `episodes.parquet` that are buffered in memory before they are written.
const BUFFERED_EPISODES: usize = 256;

impl Recorder {
    /// Creates the three files in the folder, under temporary names.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn create(
        folder: &ShardFolder,
        task: Task,
        competition: &Arc<Competition>,
    ) -> Result<Self, RecordingError> {
        let steps = StepRows::new(task, &competition.recording);
        let episodes = EpisodeRows::new(competition);
        let clips = File::create(folder.partial(CLIPS_FILE))?;
        Ok(Self {
            steps_file: TableWriter::create(&folder.partial(STEPS_FILE), steps.schema())?,
            episodes_file: TableWriter::create(&folder.partial(EPISODES_FILE), episodes.schema())?,
            clips: ClipRecorder::new(task, competition, BufWriter::new(clips))?,
            steps,
            episodes,
        })
    }

    fn end_episode(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordingError> {
        self.steps_file.write(self.steps.take())?;
        self.episodes.end(outcome, host_interference_reruns)?;
        if self.episodes.len() >= BUFFERED_EPISODES {
            self.episodes_file.write(self.episodes.take())?;
        }
        Ok(())
    }

    /// Writes the buffered rows and closes the files.
    ///
    /// # Errors
    /// [`RecordingError::Io`], or if the tables cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.episodes_file.write(self.episodes.take())?;
        self.episodes_file.finish()?;
        self.steps_file.finish()?;
        let clips = self.clips.finish()?;
        let clips = clips
            .into_inner()
            .map_err(std::io::IntoInnerError::into_error)?;
        Ok(clips.sync_all()?)
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder")
            .field("buffered_episodes", &self.episodes.len())
            .finish_non_exhaustive()
    }
}

impl StepSink for Recorder {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.steps.begin(start.episode);
        self.episodes.begin(&start);
        self.clips.begin(start);
    }

    fn observe(&mut self, observation: &[f64]) {
        self.steps.observe(observation);
        self.clips.observe(observation);
    }

    fn step(&mut self, row: &StepRow<'_>) {
        self.steps.push(row);
        self.episodes.step(row);
        self.clips.step(row);
    }

    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordError> {
        self.clips.end(outcome, host_interference_reruns)?;
        self.end_episode(outcome, host_interference_reruns)
            .map_err(|error| RecordError {
                what: "recording an episode".to_owned(),
                source: error.into(),
            })
    }
}

//! Records the clips of a shard as it is played.

use crate::{
    episode::Recording,
    error::ReplayError,
    gzip::Gzip,
    pack::{Key, PackWriter},
    sheet::Sheet,
};
use faceoff_episode::{EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_types::{EpisodeOutcome, Task};
use std::io::Write;

/// Writes a pack of the episodes of one task. Memory is bounded by one episode's samples and a line for each.
pub struct ClipRecorder<W> {
    task: Task,
    pack: PackWriter<W>,
    sheet: Sheet,
    under_way: Option<Recording>,
    gzip: Gzip,
}

impl<W> std::fmt::Debug for ClipRecorder<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClipRecorder")
            .field("task", &self.task)
            .field("episodes", &self.sheet.episodes.len())
            .finish_non_exhaustive()
    }
}

impl<W: Write> ClipRecorder<W> {
    /// Begins a pack.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn new(task: Task, out: W) -> Result<Self, ReplayError> {
        Ok(Self {
            task,
            pack: PackWriter::new(out)?,
            sheet: Sheet::default(),
            under_way: None,
            gzip: Gzip::default(),
        })
    }

    /// Adds the sheet and the index.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn finish(mut self) -> Result<W, ReplayError> {
        self.pack.add_sheet(&self.sheet)?;
        self.pack.finish()
    }

    fn end_episode(&mut self, outcome: &EpisodeOutcome) -> Result<(), ReplayError> {
        let Some(recording) = self.under_way.take() else {
            return Ok(());
        };
        let times = self.sheet.times.entry(self.task).or_default();
        let recorded = recording.end(outcome, times);
        let [motion, observed] = recorded.compressed(&mut self.gzip)?;
        let episode = outcome.episode;
        self.pack.add(Key::motion(self.task, episode), &motion)?;
        self.pack
            .add(Key::observed(self.task, episode), &observed)?;
        self.sheet.episodes.push(recorded.line);
        Ok(())
    }
}

impl<W: Write> StepSink for ClipRecorder<W> {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.under_way = Some(Recording::begin(&start));
    }

    fn observe(&mut self, observation: &[f64]) {
        if let Some(recording) = &mut self.under_way {
            recording.observe(observation);
        }
    }

    fn step(&mut self, row: &StepRow<'_>) {
        if let Some(recording) = &mut self.under_way {
            recording.step(row);
        }
    }

    fn end(&mut self, outcome: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.end_episode(outcome).map_err(|error| RecordError {
            what: "recording an episode's clips".to_owned(),
            source: error.into(),
        })
    }
}

//! Records the clips (for replays) of a shard, a range of episodes of one task, while it is played.

use crate::{
    clip_index::ClipIndex,
    episode::Recording,
    error::ReplayError,
    gzip::Gzip,
    pack::{ClipKey, PackWriter},
    summary_recording::SummaryRecording,
};
use faceoff_episode::{EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_types::{Competition, EpisodeOutcome, Task};
use std::{io::Write, sync::Arc};

/// Writes a pack of the episodes of one task. It holds the samples of one episode and a summary of each episode in memory.
pub struct ClipRecorder<W> {
    task: Task,
    competition: Arc<Competition>,
    pack: PackWriter<W>,
    index: ClipIndex,
    /// The episode that is being recorded.
    current: Option<Current>,
    gzip: Gzip,
}

/// An episode that is being recorded.
enum Current {
    /// With clips.
    AirHockey(Box<Recording>),
    /// In another world: a summary without clips.
    SummaryOnly(SummaryRecording),
}

impl<W> std::fmt::Debug for ClipRecorder<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClipRecorder")
            .field("task", &self.task)
            .field("episodes", &self.index.episodes.len())
            .finish_non_exhaustive()
    }
}

impl<W: Write> ClipRecorder<W> {
    /// Starts a pack.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn new(task: Task, competition: &Arc<Competition>, out: W) -> Result<Self, ReplayError> {
        Ok(Self {
            task,
            competition: competition.clone(),
            pack: PackWriter::new(out)?,
            index: ClipIndex::default(),
            current: None,
            gzip: Gzip::default(),
        })
    }

    /// Writes the index of episodes (their summaries), and the index of clips (their places in the file).
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn finish(mut self) -> Result<W, ReplayError> {
        self.pack.add_index(&self.index)?;
        self.pack.finish()
    }

    fn end_episode(&mut self, outcome: &EpisodeOutcome) -> Result<(), ReplayError> {
        let Some(recording) = self.current.take() else {
            return Ok(());
        };
        let times = self.index.times.entry(self.task).or_default();
        let recording = match recording {
            Current::AirHockey(recording) => *recording,
            Current::SummaryOnly(recording) => {
                let summary = recording.end(outcome, &self.competition, times);
                self.index.episodes.push(summary);
                return Ok(());
            }
        };
        let clips = recording.end(outcome, times);
        let [motion, observed] = clips.compressed(&mut self.gzip)?;
        let episode = outcome.episode;
        self.pack
            .add(ClipKey::motion(self.task, episode), &motion)?;
        self.pack
            .add(ClipKey::observed(self.task, episode), &observed)?;
        self.index.episodes.push(clips.summary);
        Ok(())
    }
}

impl<W: Write> StepSink for ClipRecorder<W> {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        let recording = Recording::begin(&start).map(Box::new);
        self.current = Some(recording.map_or_else(
            || Current::SummaryOnly(SummaryRecording::default()),
            Current::AirHockey,
        ));
    }

    fn observe(&mut self, observation: &[f64]) {
        if let Some(Current::AirHockey(recording)) = &mut self.current {
            recording.observe(observation);
        }
    }

    fn step(&mut self, row: &StepRow<'_>) {
        match &mut self.current {
            Some(Current::AirHockey(recording)) => recording.step(row),
            Some(Current::SummaryOnly(recording)) => recording.step(row, &self.competition),
            None => {}
        }
    }

    fn end(&mut self, outcome: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.end_episode(outcome).map_err(|error| RecordError {
            what: "recording an episode's clips".to_owned(),
            source: error.into(),
        })
    }
}

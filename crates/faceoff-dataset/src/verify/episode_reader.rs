//! Reads the recorded episodes of a dataset or shard one after the other, for their verification.

use super::{difference::Difference, error::VerifyError};
use crate::{
    dataset::{Columns, Dataset, FileRange, StepBatches, StepTable, episode_batches},
    files::{EPISODES_FILE, STEPS_FILE},
};
use arrow_array::RecordBatch;
use faceoff_types::{Competition, Task, TaskMap};
use faceoff_wire::job::ShardSpec;
use std::{path::Path, sync::Arc};

/// The recording of one episode.
pub(super) struct RecordedEpisode {
    pub task: Task,
    pub episode: u32,
    /// The episode's row of `episodes.parquet`.
    pub row: RecordBatch,
    /// The steps of the episode, as many as its row states.
    pub steps: Vec<RecordBatch>,
}

/// Consecutive episodes, and the error that ended their reading, if any.
pub(super) struct EpisodeBatch {
    pub episodes: Vec<RecordedEpisode>,
    pub result: Result<(), VerifyError>,
}

impl Default for EpisodeBatch {
    fn default() -> Self {
        Self {
            episodes: Vec::new(),
            result: Ok(()),
        }
    }
}

/// Reads the episodes of a dataset, and checks their order.
pub(super) struct EpisodeReader<'a> {
    /// Task and number of the remaining episodes, by the manifest or the shard's specification.
    expected: Box<dyn Iterator<Item = (Task, u32)> + Send + 'a>,
    /// The remaining rows of `episodes.parquet`.
    rows: Box<dyn Iterator<Item = RecordBatch> + Send>,
    steps: StepBatches,
    steps_of_tasks: TaskMap<u64>,
    competition: Arc<Competition>,
}

impl<'a> EpisodeReader<'a> {
    /// Opens a dataset, whose episodes are in the order of `tasks`.
    pub fn open(
        dataset: &'a Dataset,
        tasks: Vec<Task>,
        competition: &Arc<Competition>,
    ) -> Result<Self, VerifyError> {
        let counts = &dataset.manifest().episodes;
        let expected = tasks.into_iter().flat_map(|task| {
            let count = counts.get(&task).copied().unwrap_or_default();
            (0..count).map(move |episode| (task, episode))
        });
        Ok(Self::new(
            Box::new(expected),
            dataset.episode_batches()?,
            dataset.steps()?.read(None)?,
            competition,
        ))
    }

    /// Opens a shard (a range of episodes of one task), of whose specified episodes the first `played` were played. The
    /// paths are those of its two tables.
    pub fn open_shard(
        spec: &ShardSpec,
        played: usize,
        episodes: &Path,
        steps: &Path,
        competition: &Arc<Competition>,
    ) -> Result<Self, VerifyError> {
        let task = spec.task;
        let expected = spec.episodes.clone().take(played);
        let steps = StepTable::open(FileRange::whole(steps)?, competition)?;
        Ok(Self::new(
            Box::new(expected.map(move |episode| (task, episode))),
            episode_batches(FileRange::whole(episodes)?, played as u64, competition)?,
            steps.read(None)?,
            competition,
        ))
    }

    fn new(
        expected: Box<dyn Iterator<Item = (Task, u32)> + Send + 'a>,
        batches: Vec<RecordBatch>,
        steps: StepBatches,
        competition: &Arc<Competition>,
    ) -> Self {
        let mut steps_of_tasks = TaskMap::new();
        for batch in &batches {
            let columns = Columns(batch);
            for row in 0..batch.num_rows() {
                let task = columns.text("task", row).and_then(|task| task.parse().ok());
                if let (Some(task), Some(steps)) = (task, columns.int("steps", row)) {
                    *steps_of_tasks.entry(task).or_default() += u64::from(steps);
                }
            }
        }
        let rows = batches
            .into_iter()
            .flat_map(|batch| (0..batch.num_rows()).map(move |row| batch.slice(row, 1)));
        Self {
            expected,
            rows: Box::new(rows),
            steps,
            steps_of_tasks,
            competition: competition.clone(),
        }
    }

    /// Number of control steps per task, as stated by the rows of its episodes.
    pub fn steps_of_tasks(&self) -> TaskMap<u64> {
        self.steps_of_tasks.clone()
    }

    /// The next `count` episodes; empty after the last.
    pub fn next_episodes(&mut self, count: usize) -> EpisodeBatch {
        let mut batch = EpisodeBatch::default();
        while batch.episodes.len() < count {
            match self.next_episode() {
                Ok(Some(episode)) => batch.episodes.push(episode),
                Ok(None) => break,
                Err(error) => {
                    batch.result = Err(error);
                    break;
                }
            }
        }
        batch
    }

    /// The next episode; `None` after the last.
    ///
    /// # Errors
    /// A difference if an episode is missing, repeated or surplus; another error if a table cannot be read.
    fn next_episode(&mut self) -> Result<Option<RecordedEpisode>, VerifyError> {
        let (task, episode, row) = match (self.expected.next(), self.rows.next()) {
            (None, None) => {
                return match self.steps.take_rows(1)?.pop() {
                    None => Ok(None),
                    Some(extra) => Err(self.extra_row(STEPS_FILE, &extra, "no more steps")),
                };
            }
            (None, Some(extra)) => {
                return Err(self.extra_row(EPISODES_FILE, &extra, "no more episodes"));
            }
            (Some((task, episode)), None) => {
                return Err(difference(
                    task,
                    episode,
                    EPISODES_FILE,
                    "episode",
                    "nothing",
                    episode,
                ));
            }
            (Some((task, episode)), Some(row)) => (task, episode, row),
        };
        let columns = Columns(&row);
        let found = columns.text("task", 0);
        if found != Some(task.as_str()) {
            return Err(difference(
                task,
                episode,
                EPISODES_FILE,
                "task",
                value_text(found),
                task,
            ));
        }
        let found = columns.int("episode", 0);
        if found != Some(episode) {
            return Err(difference(
                task,
                episode,
                EPISODES_FILE,
                "episode",
                value_text(found),
                episode,
            ));
        }
        let longest = self.competition.max_steps(task);
        let count = match columns.int("steps", 0) {
            Some(count) if count <= longest => count as usize,
            found => {
                let expected = format!("at most {longest}");
                return Err(difference(
                    task,
                    episode,
                    EPISODES_FILE,
                    "steps",
                    value_text(found),
                    expected,
                ));
            }
        };
        let steps = self.steps.take_rows(count)?;
        let read: usize = steps.iter().map(RecordBatch::num_rows).sum();
        if read < count {
            let mut missing = difference(task, episode, STEPS_FILE, "step", "nothing", read);
            if let VerifyError::Differs(difference) = &mut missing {
                difference.step = u32::try_from(read).ok();
            }
            return Err(missing);
        }
        Ok(Some(RecordedEpisode {
            task,
            episode,
            row,
            steps,
        }))
    }

    /// The difference for a row after the last expected one.
    fn extra_row(&self, file: &'static str, row: &RecordBatch, expected: &str) -> VerifyError {
        let columns = Columns(row);
        Difference {
            file,
            task: columns.text("task", 0).and_then(|task| task.parse().ok()),
            episode: columns.int("episode", 0),
            rally: None,
            step: (file == STEPS_FILE)
                .then(|| columns.int("step", 0))
                .flatten(),
            field: "rows".to_owned(),
            recorded: "another row".to_owned(),
            expected: expected.to_owned(),
        }
        .into()
    }
}

fn value_text<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(|| "nothing".to_owned(), |value| value.to_string())
}

fn difference(
    task: Task,
    episode: u32,
    file: &'static str,
    field: &str,
    recorded: impl ToString,
    expected: impl ToString,
) -> VerifyError {
    Difference {
        file,
        task: Some(task),
        episode: Some(episode),
        rally: None,
        step: None,
        field: field.to_owned(),
        recorded: recorded.to_string(),
        expected: expected.to_string(),
    }
    .into()
}

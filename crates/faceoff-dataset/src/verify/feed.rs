use super::{difference::Difference, error::VerifyError};
use crate::{
    dataset::{Columns, Dataset, FileRange, StepBatches, StepTable, episode_batches},
    files::{EPISODES_FILE, STEPS_FILE},
};
use arrow_array::RecordBatch;
use faceoff_sim::EPISODE_STEPS;
use faceoff_types::Task;
use faceoff_wire::job::ShardSpec;
use std::{collections::BTreeMap, path::Path};

/// What is recorded of one episode.
pub(super) struct Recorded {
    pub task: Task,
    pub episode: u32,
    pub row: RecordBatch,
    /// Its steps, as many as the row says.
    pub steps: Vec<RecordBatch>,
}

/// Some episodes that follow each other, and the trouble met behind them.
pub(super) struct Episodes {
    pub read: Vec<Recorded>,
    pub then: Result<(), VerifyError>,
}

impl Default for Episodes {
    fn default() -> Self {
        Self {
            read: Vec::new(),
            then: Ok(()),
        }
    }
}

/// The episodes of a dataset in the order in which they must be there.
pub(super) struct Feed<'a> {
    expected: Box<dyn Iterator<Item = (Task, u32)> + Send + 'a>,
    rows: Box<dyn Iterator<Item = RecordBatch> + Send>,
    steps: StepBatches,
    steps_of_tasks: BTreeMap<Task, u64>,
}

impl<'a> Feed<'a> {
    pub fn open(dataset: &'a Dataset) -> Result<Self, VerifyError> {
        let expected = dataset
            .manifest()
            .episodes
            .iter()
            .flat_map(|(task, count)| (0..*count).map(|episode| (*task, episode)));
        Ok(Self::of(
            Box::new(expected),
            dataset.episode_batches()?,
            dataset.steps()?.read(None)?,
        ))
    }

    /// The episodes of a shard, the first so many of those that it is of.
    pub fn of_shard(
        spec: &ShardSpec,
        played: usize,
        episodes: &Path,
        steps: &Path,
    ) -> Result<Self, VerifyError> {
        let task = spec.task;
        let expected = spec.episodes.clone().take(played);
        let steps = StepTable::open(FileRange::whole(steps)?)?;
        Ok(Self::of(
            Box::new(expected.map(move |episode| (task, episode))),
            episode_batches(FileRange::whole(episodes)?)?,
            steps.read(None)?,
        ))
    }

    fn of(
        expected: Box<dyn Iterator<Item = (Task, u32)> + Send + 'a>,
        batches: Vec<RecordBatch>,
        steps: StepBatches,
    ) -> Self {
        let mut steps_of_tasks = BTreeMap::new();
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
        }
    }

    /// How many control steps the episodes of each task have, as their rows say.
    pub fn steps_of_tasks(&self) -> BTreeMap<Task, u64> {
        self.steps_of_tasks.clone()
    }

    /// The next episodes; none after the last.
    pub fn next_episodes(&mut self, count: usize) -> Episodes {
        let mut episodes = Episodes::default();
        while episodes.read.len() < count {
            match self.next_episode() {
                Ok(Some(episode)) => episodes.read.push(episode),
                Ok(None) => break,
                Err(trouble) => {
                    episodes.then = Err(trouble);
                    break;
                }
            }
        }
        episodes
    }

    /// The next episode; none after the last.
    ///
    /// # Errors
    /// A difference if an episode is missing, twice or too many; or the table cannot be read.
    fn next_episode(&mut self) -> Result<Option<Recorded>, VerifyError> {
        let (task, episode, row) = match (self.expected.next(), self.rows.next()) {
            (None, None) => {
                return match self.steps.take_rows(1)?.pop() {
                    None => Ok(None),
                    Some(extra) => Err(self.extra(STEPS_FILE, &extra, "no more steps")),
                };
            }
            (None, Some(extra)) => {
                return Err(self.extra(EPISODES_FILE, &extra, "no more episodes"));
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
                shown(found),
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
                shown(found),
                episode,
            ));
        }
        let count = match columns.int("steps", 0) {
            Some(count) if count <= EPISODE_STEPS => count as usize,
            found => {
                let expected = format!("at most {EPISODE_STEPS}");
                return Err(difference(
                    task,
                    episode,
                    EPISODES_FILE,
                    "steps",
                    shown(found),
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
        Ok(Some(Recorded {
            task,
            episode,
            row,
            steps,
        }))
    }

    /// A row after the last that belongs here.
    fn extra(&self, file: &'static str, row: &RecordBatch, expected: &str) -> VerifyError {
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

fn shown<T: ToString>(value: Option<T>) -> String {
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

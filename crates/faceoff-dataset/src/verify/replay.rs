use super::{compare, difference::Difference, feed::Recorded};
use crate::{
    dataset::Columns,
    files::{EPISODES_FILE, STEPS_FILE},
    interpolation_text,
    score::Measured,
    table::{EpisodeRows, HOST_TIME, StepRows},
    times::seconds,
};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_episode::{AnswerTiming, Arena, RunningEpisode, EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_types::{ACTION_LIMIT, AgentFault, EpisodeOutcome, Interpolation, Ruleset};

/// What it takes to simulate the episodes of an evaluation again.
pub(super) struct Replay {
    ruleset: Ruleset,
    arena: Arena,
}

/// An episode that is what was recorded.
pub(super) struct Replayed {
    pub outcome: EpisodeOutcome,
    /// What scoring needs of its steps.
    pub steps: Vec<Measured>,
    pub host_noise_reruns: u32,
}

/// One episode being simulated again, with the recorded answers.
struct Again<'a> {
    recorded: &'a Recorded,
    ruleset: Ruleset,
    interpolation: Interpolation,
    course: RunningEpisode<Rows>,
}

/// The rows that the episode should have.
struct Rows {
    steps: StepRows,
    episodes: EpisodeRows,
    measured: Vec<Measured>,
}

impl StepSink for Rows {
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
        let c = row.constraints;
        self.measured.push(Measured {
            answered: row.timing,
            constraints: [c.joint_pos, c.joint_vel, c.ee, c.link],
        });
    }

    fn end(&mut self, outcome: &EpisodeOutcome, host_noise_reruns: u32) -> Result<(), RecordError> {
        self.episodes
            .end(outcome, host_noise_reruns)
            .map_err(|error| RecordError {
                what: "the episode's row".to_owned(),
                source: error.into(),
            })
    }
}

/// What the agent made of the episode, as far as it cannot be simulated.
struct Given {
    interpolation: Option<Interpolation>,
    fault: Option<AgentFault>,
}

impl Replay {
    pub const fn new(ruleset: Ruleset, arena: Arena) -> Self {
        Self { ruleset, arena }
    }

    /// Simulates an episode again and compares every number of it.
    pub fn episode(&self, recorded: &Recorded) -> Result<Replayed, Difference> {
        let given = given(recorded)?;
        let rows = Rows {
            steps: StepRows::new(recorded.task),
            episodes: EpisodeRows::new(),
            measured: Vec::new(),
        };
        let (task, episode) = (recorded.task, recorded.episode);
        let mut again = Again {
            recorded,
            ruleset: self.ruleset,
            // Without an agent there are no steps to interpolate.
            interpolation: given.interpolation.unwrap_or(Interpolation::Cubic),
            course: RunningEpisode::begin(&self.arena, task, episode, given.interpolation, rows),
        };
        let mut ended = None;
        for piece in &recorded.steps {
            ended = again.piece(piece)?.or(ended);
        }
        again.end(ended, given.fault)
    }
}

impl Again<'_> {
    /// Plays the actions of some steps, and compares what they led to.
    fn piece(&mut self, piece: &RecordBatch) -> Result<Option<EpisodeOutcome>, Difference> {
        let first = self.course.steps();
        let mut ended = None;
        let trouble = (0..piece.num_rows()).find_map(|row| match self.step(piece, row) {
            Ok(outcome) => {
                ended = outcome.or(ended.take());
                None
            }
            Err(difference) => Some(difference),
        });
        let steps = &mut self.course.sink().steps;
        let played = RecordBatch::try_new(steps.schema().clone(), steps.take())
            .expect("the rows are built by their own schema");
        // What was played before the trouble comes first.
        if let Some(cell) = compare::rows(piece, &played) {
            let step = first.saturating_add(u32::try_from(cell.row).unwrap_or(u32::MAX));
            return Err(self.at_step(step, &cell.field, cell.recorded, cell.expected));
        }
        trouble.map_or(Ok(ended), Err)
    }

    fn step(
        &mut self,
        piece: &RecordBatch,
        row: usize,
    ) -> Result<Option<EpisodeOutcome>, Difference> {
        let step = self.course.steps();
        if let Some(end) = self.course.end() {
            let expected = format!("no more steps: the episode has ended ({})", end.as_str());
            return Err(self.at_step(step, "step", "another step".to_owned(), expected));
        }
        let action = self.action(piece, row, step)?;
        let answered = self.answered(piece, row, step)?;
        // That the world diverged is the course's to remember: the recorded fault must say so, too.
        Ok(self
            .course
            .answer(action.values(), answered)
            .unwrap_or_default())
    }

    /// The recorded action: it is the simulation's input, so it must be one.
    fn action(
        &self,
        piece: &RecordBatch,
        row: usize,
        step: u32,
    ) -> Result<Float64Array, Difference> {
        let actions: &ListArray = piece["action"].as_list();
        let wrong = |recorded: String| {
            let expected = match self.ruleset {
                Ruleset::First => format!("{} finite numbers", self.interpolation.len()),
                Ruleset::Second | Ruleset::Third => format!(
                    "{} numbers of at most {ACTION_LIMIT} in magnitude",
                    self.interpolation.len()
                ),
            };
            self.at_step(step, "action", recorded, expected)
        };
        if actions.is_null(row) {
            return Err(wrong("nothing".to_owned()));
        }
        let values = actions.value(row);
        let action: &Float64Array = values.as_primitive::<Float64Type>();
        if action.len() != self.interpolation.len() || action.null_count() > 0 {
            return Err(wrong(format!(
                "{} numbers",
                action.len() - action.null_count()
            )));
        }
        let limit = self.ruleset.action_limit();
        let allowed = |number: &&f64| number.abs() <= limit;
        match action.values().iter().find(|number| !allowed(number)) {
            Some(number) => Err(wrong(format!("{number:?}"))),
            None => Ok(action.clone()),
        }
    }

    /// The recorded times, which nothing else tells.
    fn answered(&self, piece: &RecordBatch, row: usize, step: u32) -> Result<AnswerTiming, Difference> {
        let time = |name: &str| -> Result<Option<i64>, Difference> {
            let column: &Int64Array = piece[name].as_primitive::<Int64Type>();
            if column.is_null(row) {
                return Ok(None);
            }
            match column.value(row) {
                negative @ ..0 => {
                    Err(self.at_step(step, name, negative.to_string(), "at least 0".to_owned()))
                }
                time => Ok(Some(time)),
            }
        };
        let name = "computation_time_ns";
        let Some(computation_time) = time(name)? else {
            return Err(self.at_step(step, name, "nothing".to_owned(), "a time".to_owned()));
        };
        Ok(AnswerTiming {
            computation_time_s: seconds(computation_time),
            host_time_s: time(HOST_TIME)?.map(seconds).unwrap_or_default(),
            cpu_time_s: time("cpu_time_ns")?.map(seconds),
        })
    }

    /// The episode's outcome from its course and the recorded fault, and its row.
    fn end(
        mut self,
        ended: Option<EpisodeOutcome>,
        fault: Option<AgentFault>,
    ) -> Result<Replayed, Difference> {
        let (recorded, steps) = (self.recorded, self.course.steps());
        let diverged = self.course.diverged().map(ToString::to_string);
        let outcome = match (ended, fault) {
            (Some(outcome), None) => outcome,
            (None, Some(fault)) => {
                let told = fault.to_string();
                self.course.outcome_after_recorded_fault(fault).ok_or_else(|| {
                    let expected = diverged
                        .unwrap_or_else(|| format!("a fault of this episode after {steps} steps"));
                    in_row(recorded, "fault", told, expected)
                })?
            }
            (Some(outcome), Some(fault)) => {
                let end = outcome.end.as_str();
                let expected = format!("none: the episode ended before ({end})");
                return Err(in_row(recorded, "fault", fault.to_string(), expected));
            }
            (None, None) => {
                if let Some(expected) = diverged {
                    return Err(in_row(recorded, "fault", "nothing", expected));
                }
                let expected = "more: the episode has not ended".to_owned();
                return Err(in_row(recorded, "steps", steps.to_string(), expected));
            }
        };
        // Nothing but the record tells it.
        let reruns = Columns(&recorded.row).int("host_noise_reruns", 0);
        let host_noise_reruns = reruns.unwrap_or_default();
        let rows = self.course.sink();
        if let Err(error) = rows.end(&outcome, host_noise_reruns) {
            return Err(in_row(recorded, "fault", error.to_string(), "a fault"));
        }
        let played = RecordBatch::try_new(rows.episodes.schema().clone(), rows.episodes.take())
            .expect("the row is built by its own schema");
        match compare::rows(&recorded.row, &played) {
            None => Ok(Replayed {
                outcome,
                steps: std::mem::take(&mut rows.measured),
                host_noise_reruns,
            }),
            Some(cell) => Err(in_row(recorded, &cell.field, cell.recorded, cell.expected)),
        }
    }

    fn at_step(&self, step: u32, field: &str, recorded: String, expected: String) -> Difference {
        Difference {
            file: STEPS_FILE,
            task: Some(self.recorded.task),
            episode: Some(self.recorded.episode),
            rally: None,
            step: Some(step),
            field: field.to_owned(),
            recorded,
            expected,
        }
    }
}

/// The answers of the agent that its row holds.
fn given(recorded: &Recorded) -> Result<Given, Difference> {
    let columns = Columns(&recorded.row);
    let fault = columns
        .text("fault", 0)
        .map(serde_json::from_str::<AgentFault>)
        .transpose()
        .map_err(|error| in_row(recorded, "fault", error.to_string(), "a fault as JSON"))?;
    let interpolation = match columns.text("interpolation", 0) {
        None => None,
        Some(text) => {
            let expected = "1 to 5, -1 or null";
            Some(
                interpolation_text::parse(text)
                    .ok_or_else(|| in_row(recorded, "interpolation", text, expected))?,
            )
        }
    };
    let started = fault.as_ref().is_none_or(|fault| fault.episode.is_some());
    if started != interpolation.is_some() {
        let expected = if started {
            "the agent's, which had started"
        } else {
            "nothing: the agent had not started"
        };
        let text = columns.text("interpolation", 0).unwrap_or("nothing");
        return Err(in_row(recorded, "interpolation", text, expected));
    }
    Ok(Given {
        interpolation,
        fault,
    })
}

fn in_row(
    recorded: &Recorded,
    field: &str,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Difference {
    let Recorded { task, episode, .. } = recorded;
    Difference {
        file: EPISODES_FILE,
        task: Some(*task),
        episode: Some(*episode),
        rally: None,
        step: None,
        field: field.to_owned(),
        recorded: found.into(),
        expected: expected.into(),
    }
}

use super::{Difference, compare, feed::Recorded};
use crate::{
    dataset::Columns,
    host_noise::Times,
    recording::{EPISODES_FILE, EpisodeRows, STEPS_FILE, StepRows, StepScan, end_name, seconds},
};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_episode::{Answered, EpisodeStart, StepRow};
use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant};
use faceoff_types::{AgentFault, EpisodeEnd, EpisodeOutcome, Factor, Profile, Seed};
use faceoff_wire::{InterpolationCode, dataset::DatasetManifest};

/// What it takes to simulate the episodes of an evaluation again.
pub(super) struct Replay {
    profile: Profile,
    seed: Seed,
    settings: PerturbationSettings,
    plant: Plant,
}

/// An episode that is what was recorded.
pub(super) struct Replayed {
    pub outcome: EpisodeOutcome,
    pub scan: StepScan,
    /// As recorded.
    pub host_noise_reruns: u32,
}

/// One episode being simulated again.
struct Course<'a> {
    recorded: &'a Recorded,
    world: Episode,
    interpolation: Interpolation,
    steps: StepRows,
    episodes: EpisodeRows,
    times: Times,
    scan: StepScan,
    ended: Option<EpisodeEnd>,
}

/// What the agent made of the episode, as far as it cannot be simulated.
struct Given {
    interpolation: Option<InterpolationCode>,
    fault: Option<AgentFault>,
}

impl Replay {
    pub fn new(manifest: &DatasetManifest) -> Self {
        let settings = PerturbationSettings::default();
        let plant = if manifest.profile.factors().contains(Factor::ModelMismatch) {
            Plant::mismatched(&settings, manifest.mismatch_seed)
        } else {
            Plant::nominal()
        };
        Self {
            profile: manifest.profile,
            seed: manifest.seed,
            settings,
            plant,
        }
    }

    /// Simulates an episode again and compares every number of it.
    pub fn episode(&self, recorded: &Recorded) -> Result<Replayed, Difference> {
        let given = given(recorded)?;
        // As for the player: an agent that never said anything has no interpolation.
        let code = given.interpolation.map_or(Some(3), InterpolationCode::code);
        let interpolation = Interpolation::from_code(code).ok_or_else(|| {
            in_row(
                recorded,
                "interpolation",
                shown(code),
                "one of the protocol",
            )
        })?;
        let seed = self.seed.episode(recorded.task, recorded.episode);
        let world = Episode::new(
            recorded.task,
            interpolation,
            self.profile.factors(),
            &self.settings,
            &self.plant,
            seed,
        );
        let mut course = Course {
            recorded,
            world,
            interpolation,
            steps: StepRows::new(recorded.task),
            episodes: EpisodeRows::new(),
            times: Times::default(),
            scan: StepScan::default(),
            ended: None,
        };
        course.steps.begin(recorded.episode);
        course.episodes.begin(&EpisodeStart {
            episode: recorded.episode,
            seed,
            interpolation: given.interpolation,
            state: &course.world.state(),
        });
        for piece in &recorded.steps {
            course.piece(piece)?;
        }
        course.end(given.fault)
    }
}

impl Course<'_> {
    /// Plays the actions of some steps, and compares what they led to.
    fn piece(&mut self, piece: &RecordBatch) -> Result<(), Difference> {
        let first = self.world.steps();
        let trouble = (0..piece.num_rows()).find_map(|row| self.step(piece, row).err());
        let schema = self.steps.schema().clone();
        let played = RecordBatch::try_new(schema, self.steps.take())
            .expect("the rows are built by their own schema");
        // What was played before the trouble comes first.
        if let Some(cell) = compare::rows(piece, &played) {
            let step = first.saturating_add(u32::try_from(cell.row).unwrap_or(u32::MAX));
            return Err(self.at_step(step, &cell.field, cell.recorded, cell.expected));
        }
        trouble.map_or(Ok(()), Err)
    }

    fn step(&mut self, piece: &RecordBatch, row: usize) -> Result<(), Difference> {
        let step = self.world.steps();
        if let Some(end) = self.ended {
            let expected = format!("no more steps: the episode has ended ({})", end_name(end));
            return Err(self.at_step(step, "step", "another step".to_owned(), expected));
        }
        let action = self.action(piece, row, step)?;
        let answered = self.answered(piece, row, step)?;
        self.steps.observe(self.world.observation());
        let outcome = self.world.step(action.values());
        self.ended = outcome.end;
        let row = StepRow {
            step,
            action: action.values(),
            answered,
            state: &self.world.state(),
            constraints: outcome.constraints,
            next_observation: self.world.observation(),
        };
        self.steps.push(&row);
        self.episodes.step(&row);
        let time_s = answered.computation_time_s;
        self.times.add(time_s, time_s);
        self.scan.add(
            self.recorded.episode,
            step,
            answered.computation_time_s,
            outcome.constraints,
        );
        Ok(())
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
            let expected = format!("{} finite numbers", self.interpolation.len());
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
        match action.values().iter().find(|number| !number.is_finite()) {
            Some(number) => Err(wrong(number.to_string())),
            None => Ok(action.clone()),
        }
    }

    /// The recorded times, which nothing else tells.
    fn answered(&self, piece: &RecordBatch, row: usize, step: u32) -> Result<Answered, Difference> {
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
        Ok(Answered {
            computation_time_s: seconds(computation_time),
            cpu_time_s: time("cpu_time_ns")?.map(seconds),
        })
    }

    /// The episode's outcome from its course and the recorded fault, and its row.
    fn end(mut self, fault: Option<AgentFault>) -> Result<Replayed, Difference> {
        let (recorded, steps) = (self.recorded, self.world.steps());
        let end = match (self.ended, &fault) {
            (Some(end), None) => end,
            (None, Some(fault)) => {
                let during = (fault.episode, fault.step);
                let possible = [
                    (Some(recorded.episode), Some(steps)),
                    (Some(recorded.episode), None),
                    (None, None),
                ];
                if fault.task != recorded.task
                    || !possible.contains(&during)
                    || (fault.step.is_none() && steps > 0)
                {
                    let expected = format!("a fault of this episode after {steps} steps");
                    return Err(in_row(recorded, "fault", fault.to_string(), expected));
                }
                EpisodeEnd::AgentFault
            }
            (Some(end), Some(fault)) => {
                let expected = format!("none: the episode ended before ({})", end_name(end));
                return Err(in_row(recorded, "fault", fault.to_string(), expected));
            }
            (None, None) => {
                let expected = "more: the episode has not ended".to_owned();
                return Err(in_row(recorded, "steps", steps.to_string(), expected));
            }
        };
        let outcome = EpisodeOutcome {
            task: recorded.task,
            episode: recorded.episode,
            steps,
            end,
            success: fault.is_none() && self.world.success(),
            violations: self.world.violations(),
            computation_time: self.times.summary(),
            fault,
        };
        // Nothing but the record tells it.
        let reruns = Columns(&recorded.row).int("host_noise_reruns", 0);
        let host_noise_reruns = reruns.unwrap_or_default();
        if let Err(error) = self.episodes.end(&outcome, host_noise_reruns) {
            return Err(in_row(recorded, "fault", error.to_string(), "a fault"));
        }
        let schema = self.episodes.schema().clone();
        let played = RecordBatch::try_new(schema, self.episodes.take())
            .expect("the row is built by its own schema");
        match compare::rows(&recorded.row, &played) {
            None => Ok(Replayed {
                outcome,
                scan: self.scan,
                host_noise_reruns,
            }),
            Some(cell) => Err(in_row(recorded, &cell.field, cell.recorded, cell.expected)),
        }
    }

    fn at_step(&self, step: u32, field: &str, recorded: String, expected: String) -> Difference {
        Difference {
            file: STEPS_FILE.to_owned(),
            task: Some(self.recorded.task),
            episode: Some(self.recorded.episode),
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
            let code = match text {
                "null" => Some(None),
                number => number.parse().ok().map(Some),
            };
            let code = code.and_then(|code| InterpolationCode::new(code).ok());
            let expected = "1 to 5, -1 or null";
            Some(code.ok_or_else(|| in_row(recorded, "interpolation", text, expected))?)
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

fn shown(code: Option<i64>) -> String {
    code.map_or_else(|| "null".to_owned(), |code| code.to_string())
}

fn in_row(
    recorded: &Recorded,
    field: &str,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Difference {
    let Recorded { task, episode, .. } = recorded;
    Difference {
        file: EPISODES_FILE.to_owned(),
        task: Some(*task),
        episode: Some(*episode),
        step: None,
        field: field.to_owned(),
        recorded: found.into(),
        expected: expected.into(),
    }
}

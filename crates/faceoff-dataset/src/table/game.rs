//! The tables of a game of two agents (its *sides*): the true motion, the observations and actions of each side, the
//! rallies, and the *entries*: how each side entered each rally, with the start and reset of its agent.

use super::{columns::FloatColumns, steps::constraint_columns};
use crate::{error::RecordingError, times::nanoseconds};
use arrow_array::{
    ArrayRef,
    builder::{
        ArrayBuilder, Float64Builder, Int64Builder, ListBuilder, StringBuilder, UInt32Builder,
    },
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use faceoff_airhockey::{GameStepRow, RallyReadiness, RallyRow, RallyStart, recording_columns};
use faceoff_episode::StateColumns;
use faceoff_types::{AgentFault, Side};
use std::sync::Arc;

/// `name_1` … `name_7`.
fn joints(name: &str) -> [String; 7] {
    [1, 2, 3, 4, 5, 6, 7].map(|joint| format!("{name}_{joint}"))
}

/// Columns with the numbers of a row's step.
#[derive(Default)]
struct StepNumbers {
    game_steps: UInt32Builder,
    rallies: UInt32Builder,
    steps: UInt32Builder,
}

impl StepNumbers {
    fn fields() -> [Field; 3] {
        ["game_step", "rally", "step"].map(|name| Field::new(name, DataType::UInt32, false))
    }

    fn push(&mut self, row: &GameStepRow<'_>) {
        self.game_steps.append_value(row.game_step);
        self.rallies.append_value(row.rally);
        self.steps.append_value(row.step);
    }

    fn take(&mut self) -> Vec<ArrayRef> {
        [&mut self.game_steps, &mut self.rallies, &mut self.steps]
            .map(|column| Arc::new(column.finish()) as ArrayRef)
            .into()
    }
}

/// Rows of the true motion: one per control step.
pub(crate) struct MotionRows {
    schema: SchemaRef,
    numbers: StepNumbers,
    motion: FloatColumns,
}

impl MotionRows {
    pub fn new() -> Self {
        let mut motion = FloatColumns::default().with(
            ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| format!("puck_{c}")),
            false,
        );
        for side in Side::BOTH {
            let name = |suffix: &str| format!("robot_{}_{suffix}", side.number());
            motion = motion
                .with(joints(&name("q")), false)
                .with(joints(&name("dq")), false)
                .with(["1", "2"].map(|n| name(&format!("universal_{n}"))), false)
                .with(["x", "y", "z"].map(|c| name(&format!("ee_{c}"))), false);
        }
        let mut fields = StepNumbers::fields().to_vec();
        fields.extend_from_slice(motion.fields());
        Self {
            schema: Arc::new(Schema::new(fields)),
            numbers: StepNumbers::default(),
            motion,
        }
    }

    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub fn len(&self) -> usize {
        self.numbers.steps.len()
    }

    pub fn push(&mut self, row: &GameStepRow<'_>) {
        self.numbers.push(row);
        let (motion, state) = (&mut self.motion, row.state);
        motion.put(&state.puck);
        for robot in 0..2 {
            motion.put(&state.q[robot]);
            motion.put(&state.dq[robot]);
            motion.put(&state.universal[robot]);
            motion.put(&state.ee[robot]);
        }
        motion.end_row();
    }

    /// Removes and returns the rows so far.
    pub fn take(&mut self) -> Vec<ArrayRef> {
        let mut columns = self.numbers.take();
        columns.extend(self.motion.take());
        columns
    }
}

/// Rows of observations and actions of one side: one per control step.
pub(crate) struct SideRows {
    schema: SchemaRef,
    side: Side,
    numbers: StepNumbers,
    observations: FloatColumns,
    actions: ListBuilder<Float64Builder>,
    /// What each answer did: in time, late, fault or held (no answer, after a fault).
    effects: StringBuilder,
    /// In the order of [`SIDE_TIMES`].
    times: [Int64Builder; 3],
    constraints: FloatColumns,
}

/// Columns of a side's answer times, ns: computation time without host interference, host interference (time that other
/// programs on the evaluator's machine took), CPU time.
pub(crate) const SIDE_TIMES: [&str; 3] = ["computation_time_ns", "host_time_ns", "cpu_time_ns"];

impl SideRows {
    pub fn new(side: Side) -> Self {
        let recording = recording_columns();
        let observations =
            FloatColumns::default().with_recorded("obs_", &recording.observation, false);
        let constraints = FloatColumns::default().with(constraint_columns(&recording), false);
        let item = Arc::new(Field::new_list_field(DataType::Float64, false));
        let mut fields = StepNumbers::fields().to_vec();
        fields.extend_from_slice(observations.fields());
        fields.push(Field::new("action", DataType::List(item.clone()), true));
        fields.push(Field::new("effect", DataType::Utf8, false));
        fields.extend(SIDE_TIMES.map(|name| Field::new(name, DataType::Int64, true)));
        fields.extend_from_slice(constraints.fields());
        Self {
            schema: Arc::new(Schema::new(fields)),
            side,
            numbers: StepNumbers::default(),
            observations,
            actions: ListBuilder::new(Float64Builder::new()).with_field(item),
            effects: StringBuilder::new(),
            times: Default::default(),
            constraints,
        }
    }

    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub fn observe(&mut self, observation: &[f64]) {
        self.observations.put(observation);
        self.observations.end_short_row();
    }

    pub fn push(&mut self, row: &GameStepRow<'_>) {
        self.numbers.push(row);
        let side = &row.sides[self.side.index()];
        if let Some(action) = side.action {
            self.actions.values().append_slice(action);
        }
        self.actions.append(side.action.is_some());
        self.effects.append_value(side.effect.as_str());
        let timing = side.timing.as_ref();
        let [computation, host, cpu] = &mut self.times;
        computation.append_option(timing.map(|timing| nanoseconds(timing.computation_time_s)));
        host.append_option(timing.map(|timing| nanoseconds(timing.host_time_s)));
        cpu.append_option(timing.and_then(|timing| timing.cpu_time_s).map(nanoseconds));
        let constraints = side.constraints;
        self.constraints.put(&[
            constraints.joint_pos,
            constraints.joint_vel,
            constraints.ee,
            constraints.link,
        ]);
        self.constraints.end_row();
    }

    pub fn take(&mut self) -> Vec<ArrayRef> {
        let mut columns = self.numbers.take();
        columns.extend(self.observations.take());
        columns.push(Arc::new(self.actions.finish()));
        columns.push(Arc::new(self.effects.finish()));
        columns.extend(
            self.times
                .iter_mut()
                .map(|column| Arc::new(column.finish()) as ArrayRef),
        );
        columns.extend(self.constraints.take());
        columns
    }
}

/// Rows of the rallies. Both sides and the public may see them.
pub(crate) struct RallyRows {
    schema: SchemaRef,
    rallies: UInt32Builder,
    game_steps: UInt32Builder,
    serving_sides: UInt32Builder,
    steps: UInt32Builder,
    ends: StringBuilder,
    /// Column `by`: the side that scored the goal or committed the foul; null if the rally ended otherwise.
    responsible_sides: UInt32Builder,
    scores: [UInt32Builder; 2],
    initial: FloatColumns,
}

impl RallyRows {
    pub fn new() -> Self {
        let initial = FloatColumns::default().with(
            ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| format!("initial_puck_{c}")),
            false,
        );
        let number = |name, nullable| Field::new(name, DataType::UInt32, nullable);
        let mut fields = vec![
            number("rally", false),
            number("game_step", false),
            number("serves", false),
            number("steps", false),
            Field::new("end", DataType::Utf8, false),
            number("by", true),
            number("score_1", false),
            number("score_2", false),
        ];
        fields.extend_from_slice(initial.fields());
        Self {
            schema: Arc::new(Schema::new(fields)),
            rallies: UInt32Builder::new(),
            game_steps: UInt32Builder::new(),
            serving_sides: UInt32Builder::new(),
            steps: UInt32Builder::new(),
            ends: StringBuilder::new(),
            responsible_sides: UInt32Builder::new(),
            scores: Default::default(),
            initial,
        }
    }

    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub fn begin(&mut self, start: &RallyStart<'_>) {
        self.rallies.append_value(start.rally);
        self.game_steps.append_value(start.game_step);
        self.serving_sides.append_value(start.serving_side.number());
        self.initial.put(&start.state.puck);
        self.initial.end_row();
    }

    pub fn end(&mut self, row: &RallyRow<'_>) {
        self.steps.append_value(row.steps);
        self.ends.append_value(row.ending.as_str());
        self.responsible_sides
            .append_option(row.ending.responsible_side().map(|side| side.number()));
        for (column, score) in self.scores.iter_mut().zip(row.score) {
            column.append_value(score);
        }
    }

    pub fn take(&mut self) -> Vec<ArrayRef> {
        let [first, second] = &mut self.scores;
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(self.rallies.finish()),
            Arc::new(self.game_steps.finish()),
            Arc::new(self.serving_sides.finish()),
            Arc::new(self.steps.finish()),
            Arc::new(self.ends.finish()),
            Arc::new(self.responsible_sides.finish()),
            Arc::new(first.finish()),
            Arc::new(second.finish()),
        ];
        columns.extend(self.initial.take());
        columns
    }
}

/// Rows of one side's entries: for each rally the start and reset of the agent, and its fault in the rally.
pub(crate) struct EntryRows {
    schema: SchemaRef,
    side: Side,
    rallies: UInt32Builder,
    startups: Int64Builder,
    interpolations: StringBuilder,
    resets: Int64Builder,
    faults: StringBuilder,
}

impl EntryRows {
    pub fn new(side: Side) -> Self {
        Self {
            schema: Arc::new(Schema::new(vec![
                Field::new("rally", DataType::UInt32, false),
                Field::new("startup_ns", DataType::Int64, true),
                Field::new("interpolation", DataType::Utf8, true),
                Field::new("reset_ns", DataType::Int64, true),
                Field::new("fault", DataType::Utf8, true),
            ])),
            side,
            rallies: UInt32Builder::new(),
            startups: Int64Builder::new(),
            interpolations: StringBuilder::new(),
            resets: Int64Builder::new(),
            faults: StringBuilder::new(),
        }
    }

    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub fn begin(&mut self, start: &RallyStart<'_>) {
        let readiness = &start.readiness[self.side.index()];
        let (startup_s, reset_s) = match readiness {
            RallyReadiness::Ready {
                startup_s, reset_s, ..
            }
            | RallyReadiness::ResetFailed {
                startup_s, reset_s, ..
            } => (*startup_s, Some(*reset_s)),
            RallyReadiness::StartFailed { startup_s, .. } => (Some(*startup_s), None),
        };
        self.rallies.append_value(start.rally);
        self.startups.append_option(startup_s.map(nanoseconds));
        self.interpolations
            .append_option(readiness.interpolation().map(|code| code.to_string()));
        self.resets.append_option(reset_s.map(nanoseconds));
    }

    pub fn end(&mut self, fault: Option<&AgentFault>) -> Result<(), RecordingError> {
        let fault = fault
            .map(serde_json::to_string)
            .transpose()
            .map_err(RecordingError::unusable("writing a fault"))?;
        self.faults.append_option(fault);
        Ok(())
    }

    pub fn take(&mut self) -> Vec<ArrayRef> {
        vec![
            Arc::new(self.rallies.finish()),
            Arc::new(self.startups.finish()),
            Arc::new(self.interpolations.finish()),
            Arc::new(self.resets.finish()),
            Arc::new(self.faults.finish()),
        ]
    }
}

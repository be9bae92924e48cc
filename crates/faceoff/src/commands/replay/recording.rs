//! The recording of one episode, read from a dataset for the drawings.

use crate::competition::competition;
use anyhow::Context;
use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_airhockey::describe_end;
use faceoff_dataset::{Dataset, DatasetError, EpisodeRecord};
use faceoff_scoring::{
    COMPUTATION_TIME_LIMITS_S, COMPUTATION_TIME_MAX_POINTS, computation_time_penalty,
    tournament::{EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS},
};
use faceoff_sim::{
    JOINTS,
    model::{CONTROL_STEP_S, LINKS},
    table::geometry::TABLE,
};
use faceoff_types::{EpisodeOutcome, Task, escape_unprintable};
use std::path::Path;

/// The data of an episode that the drawings need. Positions are in the table frame, in m. "After k steps" is index k,
/// so index 0 is the start.
#[derive(Debug)]
pub struct EpisodeRecording {
    pub agent: String,
    pub profile: String,
    pub outcome: EpisodeOutcome,
    /// Penalty points of the episode.
    pub points: f64,
    pub seed: String,
    /// Reason of the episode's end, as text.
    pub end_reason: String,
    /// x, y, yaw after k steps.
    pub puck: Vec<[f64; 3]>,
    /// x, y of the puck as observed by the agent after k steps.
    pub observed_puck: Vec<[f64; 2]>,
    /// x, y of the mallet after k steps.
    pub mallet: Vec<[f64; 2]>,
    /// x, y of the opponent's mallet, from the first step on; empty without an opponent.
    pub opponent: Vec<[f64; 2]>,
    /// Filtered joint velocities as a fraction of their limits, after each step.
    pub speed_share: Vec<[f64; JOINTS]>,
    /// Joint position (rad), joint velocity (rad/s), end effector (m), elbow and wrist (m): above 0 if violated, after
    /// each step.
    pub constraints: Vec<[f64; 4]>,
    /// Counted computation time per step, s.
    pub computation_time_s: Vec<f64>,
}

/// The groups of [`EpisodeRecording::constraints`]: name, penalty points for an episode with a violation, unit.
pub const CONSTRAINTS: [(&str, f64, &str); 4] = [
    ("joint position", JOINT_POS_POINTS, "rad"),
    ("joint velocity", JOINT_VEL_POINTS, "rad/s"),
    ("end effector", EE_POINTS, "m"),
    ("elbow and wrist height", LINK_POINTS, "m"),
];

/// Columns of the puck's state.
const PUCK: [&str; 6] = [
    "puck_x",
    "puck_y",
    "puck_yaw",
    "puck_vx",
    "puck_vy",
    "puck_yaw_rate",
];

/// Values of the state before the first step, by the names of their columns.
fn initial<const N: usize>(record: &EpisodeRecord, names: [&str; N]) -> anyhow::Result<[f64; N]> {
    let columns = &competition().recording.state;
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        let index = columns.iter().position(|column| column.name == name);
        let recorded = index.and_then(|index| record.initial_state.get(index).copied()?);
        *value = recorded.with_context(|| format!("the start has no {name}"))?;
    }
    Ok(values)
}

impl EpisodeRecording {
    /// Reads one episode of a dataset without reading the steps of the others.
    pub fn read(path: &Path, task: Task, episode: u32) -> anyhow::Result<Self> {
        let dataset = Dataset::open_lazily(path, competition()).with_context(|| {
            format!("opening {} as the dataset of an evaluation", path.display())
        })?;
        let steps = dataset.episode(task, episode, None)?;
        let record = dataset
            .episodes()?
            .into_iter()
            .find(|record| record.outcome.task == task && record.outcome.episode == episode)
            .ok_or_else(|| {
                DatasetError::Absent(format!("there is no episode {episode} of {task}"))
            })?;
        let columns = Columns(&steps);

        let puck: Vec<[f64; 6]> = columns.rows(PUCK)?;
        let initial_puck = initial(&record, PUCK)?;
        let last = puck.last().unwrap_or(&initial_puck);
        let fault = record.outcome.fault.as_ref().map(|fault| &fault.fault);
        let end_reason = describe_end(task, record.outcome.end, last, record.outcome.steps, fault);

        let to_table_frame = |[x, y]: [f64; 2]| [x - TABLE.base_x_m, y];
        let observed = columns.rows(["obs_puck_x", "obs_puck_y"])?.into_iter();
        let last_observed = match record.last_observation[..] {
            [x, y, ..] => Some([x, y]),
            _ => None,
        };
        let start = initial(&record, ["ee_x", "ee_y"])?;
        let mallet = columns.rows(["ee_x", "ee_y"])?.into_iter();
        // Positions of the opponent are recorded in the frame of its own base, which is on the opposite side, rotated by 180°.
        let opponent_to_table_frame = |[x, y]: [f64; 2]| [TABLE.base_x_m - x, -y];
        let opponent = match columns.is_absent("opponent_ee_x")? {
            true => Vec::new(),
            false => columns.rows(["opponent_ee_x", "opponent_ee_y"])?,
        };
        let speeds: Vec<[f64; JOINTS]> =
            columns.rows(std::array::from_fn(|i| format!("dq_{}", i + 1)))?;
        let share = |speed: [f64; JOINTS]| {
            std::array::from_fn(|i| speed[i] / LINKS[i].velocity_limit_rad_s)
        };
        let manifest = dataset.manifest();
        Ok(Self {
            agent: escape_unprintable(&manifest.agent).into_owned(),
            profile: manifest.profile.to_string(),
            points: record.penalty_points,
            seed: record.seed,
            end_reason: escape_unprintable(&end_reason).into_owned(),
            puck: std::iter::once(initial_puck)
                .chain(puck)
                .map(|[x, y, yaw, ..]| [x, y, yaw])
                .collect(),
            observed_puck: observed.chain(last_observed).map(to_table_frame).collect(),
            mallet: std::iter::once(start)
                .chain(mallet)
                .map(to_table_frame)
                .collect(),
            opponent: opponent.into_iter().map(opponent_to_table_frame).collect(),
            speed_share: speeds.into_iter().map(share).collect(),
            constraints: columns.rows(
                ["joint_pos", "joint_vel", "ee", "link"].map(|name| format!("constraint_{name}")),
            )?,
            computation_time_s: columns.seconds("computation_time_ns")?,
            outcome: record.outcome,
        })
    }

    /// Task, number, agent and success of the episode.
    pub fn headline(&self) -> String {
        let EpisodeOutcome {
            task,
            episode,
            success,
            ..
        } = &self.outcome;
        let verdict = if *success { "success" } else { "no success" };
        format!("{task}, episode {episode} of {}: {verdict}", self.agent)
    }

    /// The penalty points with their causes, one line each.
    pub fn penalties(&self) -> Vec<String> {
        let mut penalties = Vec::new();
        for (constraint, (name, points, unit)) in CONSTRAINTS.iter().enumerate() {
            let values = || self.constraints.iter().map(|values| values[constraint]);
            if let Some(first) = self.first_violation(constraint) {
                let steps = values().filter(|value| *value > 0.0).count();
                let worst = values().fold(f64::MIN, f64::max);
                penalties.push(format!(
                    "{points} points: {name} limit violated from step {first} ({:.2} s), in {steps} steps, by up to \
                    {worst:.4} {unit}",
                    time_s(first)
                ));
            }
        }
        let time = &self.outcome.computation_time;
        if let Some(fault) = &self.outcome.fault {
            let fault = fault.to_string();
            penalties.push(format!(
                "{COMPUTATION_TIME_MAX_POINTS} points: agent fault: {}",
                escape_unprintable(&fault)
            ));
        } else if computation_time_penalty(time) > 0.0 {
            penalties.push(format!(
                "{} points: computation time up to {:.1} ms and {:.1} ms on average, where up to {:.0} ms cost nothing",
                computation_time_penalty(time),
                1e3 * time.max_s,
                1e3 * time.mean_s,
                1e3 * COMPUTATION_TIME_LIMITS_S[0]
            ));
        }
        penalties
    }

    /// Step of the first violation of a constraint, from 1.
    pub fn first_violation(&self, constraint: usize) -> Option<usize> {
        let index = self
            .constraints
            .iter()
            .position(|values| values[constraint] > 0.0);
        index.map(|index| index + 1)
    }
}

/// Time after a number of control steps, s.
#[expect(
    clippy::cast_precision_loss,
    reason = "an episode has some hundred steps"
)]
pub fn time_s(steps: usize) -> f64 {
    steps as f64 * CONTROL_STEP_S
}

/// The dataset's table of an episode: a row per control step.
struct Columns<'a>(&'a RecordBatch);

impl Columns<'_> {
    fn column(&self, name: &str) -> anyhow::Result<&dyn Array> {
        let column = self.0.column_by_name(name);
        Ok(column
            .with_context(|| format!("the table of steps has no column {name}"))?
            .as_ref())
    }

    /// The column has no value in any row.
    fn is_absent(&self, name: &str) -> anyhow::Result<bool> {
        let column = self.column(name)?;
        Ok(column.null_count() == column.len())
    }

    /// The values of the named columns, row by row.
    fn rows<const N: usize>(&self, names: [impl AsRef<str>; N]) -> anyhow::Result<Vec<[f64; N]>> {
        let mut rows = vec![[0.0; N]; self.0.num_rows()];
        for (i, name) in names.iter().enumerate() {
            let column = self.column(name.as_ref())?.as_primitive::<Float64Type>();
            for (row, value) in rows.iter_mut().zip(column.values()) {
                row[i] = *value;
            }
        }
        Ok(rows)
    }

    /// The values of a column in nanoseconds, as seconds.
    fn seconds(&self, name: &str) -> anyhow::Result<Vec<f64>> {
        let column = self.column(name)?.as_primitive::<Int64Type>();
        #[expect(clippy::cast_precision_loss, reason = "for a picture")]
        let seconds = column.values().iter().map(|ns| *ns as f64 * 1e-9);
        Ok(seconds.collect())
    }
}

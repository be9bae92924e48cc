//! Recordings of shards: every recorded number equals that of a new simulation from the seed and the recorded actions.

use crate::{
    agents::{Agent, sandboxed_environment},
    shard::{run, spec},
};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch, StringArray, UInt32Array,
    cast::AsArray,
};
use faceoff_airhockey::{HIT, TASKS};
use faceoff_sim::{AirHockeyProfile, Episode, Interpolation, PerturbationSettings, Plant};
use faceoff_types::Violations;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::{fs::File, path::Path, time::Duration};

/// Reads a whole Parquet table, in one batch.
pub fn read_table(path: &Path) -> RecordBatch {
    let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let rows = builder.metadata().file_metadata().num_rows() as usize;
    let mut batches = builder.with_batch_size(rows).build().unwrap();
    let batch = batches.next().expect("a row").unwrap();
    assert_eq!(batch.num_rows(), rows);
    batch
}

/// A column of floating-point numbers.
pub fn floats<'a>(batch: &'a RecordBatch, name: &str) -> &'a Float64Array {
    batch
        .column_by_name(name)
        .unwrap_or_else(|| panic!("{name}"))
        .as_primitive()
}

/// A column of nanoseconds, in seconds.
pub fn seconds(batch: &RecordBatch, name: &str) -> Vec<f64> {
    let column: &Int64Array = batch
        .column_by_name(name)
        .unwrap_or_else(|| panic!("{name}"))
        .as_primitive();
    column
        .values()
        .iter()
        .map(|ns| Duration::from_nanos(u64::try_from(*ns).unwrap()).as_secs_f64())
        .collect()
}

/// A column of unsigned integers.
pub fn ints<'a>(batch: &'a RecordBatch, name: &str) -> &'a UInt32Array {
    batch
        .column_by_name(name)
        .unwrap_or_else(|| panic!("{name}"))
        .as_primitive()
}

/// A column of texts.
pub fn texts<'a>(batch: &'a RecordBatch, name: &str) -> &'a StringArray {
    batch
        .column_by_name(name)
        .unwrap_or_else(|| panic!("{name}"))
        .as_string()
}

/// An agent that moves, so that every column changes.
pub fn moving_agent() -> Agent {
    Agent::with_hooks(
        "def on_step(step, answer):\n    \
         q = [x + 0.002 * (step % 7) for x in answer['action'][0]]\n    \
         return json.dumps({**answer, 'action': [q, [0.1] * 7]})",
    )
}

/// Simulates again from the seed and the recorded actions, and compares every number bit by bit.
#[test]
fn recording_matches_the_simulation() {
    let out = tempfile::tempdir().unwrap();
    for task in TASKS {
        let spec = spec(task, 4..6);
        let dir = out.path().join(task.as_str());
        let report = run(&spec, &moving_agent(), &sandboxed_environment(), &dir).unwrap();
        let steps = read_table(&dir.join("steps.parquet"));
        let episodes = read_table(&dir.join("episodes.parquet"));
        let played: u32 = report.outcomes.iter().map(|outcome| outcome.steps).sum();
        assert_eq!(steps.num_rows(), played as usize);
        assert_eq!(episodes.num_rows(), 2);

        let settings = PerturbationSettings::default();
        let plant = Plant::mismatched(&settings, spec.mismatch_seed);
        let actions: &ListArray = steps.column_by_name("action").unwrap().as_list();
        let mut row = 0;
        for (index, outcome) in report.outcomes.iter().enumerate() {
            let seed = spec.seed.episode(task, outcome.episode);
            assert_eq!(texts(&episodes, "seed").value(index), seed.to_string());
            assert_eq!(texts(&episodes, "interpolation").value(index), "3");
            assert_eq!(ints(&episodes, "steps").value(index), outcome.steps);
            let mut world = Episode::new(
                task.try_into().unwrap(),
                Interpolation::Cubic,
                AirHockeyProfile::try_from(spec.profile)
                    .unwrap()
                    .active_perturbations(),
                &settings,
                &plant,
                seed,
            );
            compare_state(&episodes, "initial_", index, &world);
            for step in 0..outcome.steps {
                assert_eq!(texts(&steps, "task").value(row), task.as_str());
                assert_eq!(ints(&steps, "episode").value(row), outcome.episode);
                assert_eq!(ints(&steps, "step").value(row), step);
                compare_observation(&steps, row, &world);
                let action = actions.value(row);
                let action: &Float64Array = action.as_primitive();
                // Positions and velocities of 7 joints.
                assert_eq!(action.len(), 14);
                let values = world.step(action.values()).constraints;
                compare_state(&steps, "", row, &world);
                for (name, value) in [
                    ("constraint_joint_pos", values.joint_pos),
                    ("constraint_joint_vel", values.joint_vel),
                    ("constraint_ee", values.ee),
                    ("constraint_link", values.link),
                ] {
                    assert_same_bits(&steps, name, row, value);
                }
                row += 1;
            }
            let last: Vec<f64> = (0..world.observation().len())
                .map(|i| floats(&episodes, &obs_names("last_obs_")[i]).value(index))
                .collect();
            assert_eq!(last, world.observation(), "after the last step");
            assert_eq!(world.success(), outcome.success);
            assert_eq!(Violations::from(world.violations()), outcome.violations);
        }
    }
}

#[track_caller]
fn assert_same_bits(batch: &RecordBatch, name: &str, row: usize, value: f64) {
    let column = floats(batch, name);
    assert!(column.is_valid(row), "{name} is absent in row {row}");
    assert_eq!(
        column.value(row).to_bits(),
        value.to_bits(),
        "{name} in row {row}"
    );
}

/// The columns of an observation, in the protocol's order.
pub fn obs_names(prefix: &str) -> Vec<String> {
    let puck = ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| format!("{prefix}puck_{c}"));
    let joints = |name: &str| {
        (1..=7)
            .map(move |joint| format!("{prefix}{name}_{joint}"))
            .collect::<Vec<_>>()
    };
    let opponent = ["x", "y", "z"].map(|c| format!("{prefix}opponent_ee_{c}"));
    [&puck[..], &joints("q"), &joints("dq"), &opponent].concat()
}

fn compare_observation(batch: &RecordBatch, row: usize, world: &Episode) {
    let names: Vec<String> = batch
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .filter(|name| name.starts_with("obs_"))
        .collect();
    assert_eq!(names, obs_names("obs_"));
    let observation = world.observation();
    for (index, name) in names.iter().enumerate() {
        match observation.get(index) {
            Some(value) => assert_same_bits(batch, name, row, *value),
            None => assert!(floats(batch, name).is_null(row), "{name}"),
        }
    }
}

fn compare_state(batch: &RecordBatch, prefix: &str, row: usize, world: &Episode) {
    let state = world.state();
    let axes = ["x", "y", "z"];
    for (name, value) in ["x", "y", "yaw", "vx", "vy", "yaw_rate"]
        .iter()
        .zip(state.puck)
    {
        assert_same_bits(batch, &format!("{prefix}puck_{name}"), row, value);
    }
    for joint in 0..7 {
        assert_same_bits(
            batch,
            &format!("{prefix}q_{}", joint + 1),
            row,
            state.q[joint],
        );
        assert_same_bits(
            batch,
            &format!("{prefix}dq_{}", joint + 1),
            row,
            state.dq[joint],
        );
        let name = format!("{prefix}opponent_q_{}", joint + 1);
        match state.opponent_q {
            Some(q) => assert_same_bits(batch, &name, row, q[joint]),
            None => assert!(floats(batch, &name).is_null(row)),
        }
    }
    for (axis, name) in axes.iter().enumerate() {
        assert_same_bits(batch, &format!("{prefix}ee_{name}"), row, state.ee[axis]);
        let name = format!("{prefix}opponent_ee_{name}");
        match state.opponent_ee {
            Some(ee) => assert_same_bits(batch, &name, row, ee[axis]),
            None => assert!(floats(batch, &name).is_null(row)),
        }
    }
    // The angles of the universal joint between arm and mallet.
    assert_same_bits(
        batch,
        &format!("{prefix}universal_1"),
        row,
        state.universal[0],
    );
    assert_same_bits(
        batch,
        &format!("{prefix}universal_2"),
        row,
        state.universal[1],
    );
}

#[test]
fn times_and_faults_are_recorded() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks(
        "def on_step(step, answer): return 'no' if step == 3 else json.dumps(answer)",
    );
    let report = run(
        &spec(HIT, 0..1),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    let steps = read_table(&out.path().join("steps.parquet"));
    assert_eq!(
        steps.num_rows(),
        3,
        "a step without a valid answer has no row"
    );
    let times = seconds(&steps, "computation_time_ns");
    let time = report.outcomes[0].computation_time;
    assert_eq!(times.iter().copied().fold(0.0, f64::max), time.max_s);
    assert_eq!(times.iter().sum::<f64>() / 3.0, time.mean_s);
    let cpu = steps.column_by_name("cpu_time_ns").unwrap();
    assert_eq!(cpu.null_count(), 0, "the sandbox reports CPU times");
    assert!(
        seconds(&steps, "cpu_time_ns")
            .iter()
            .all(|time| *time >= 0.0)
    );

    let episodes = read_table(&out.path().join("episodes.parquet"));
    assert_eq!(texts(&episodes, "end").value(0), "agent_fault");
    let fault: faceoff_types::AgentFault =
        serde_json::from_str(texts(&episodes, "fault").value(0)).unwrap();
    assert_eq!(Some(&fault), report.outcomes[0].fault.as_ref());
    assert_eq!(
        floats(&episodes, "penalty_points").value(0),
        faceoff_scoring::episode_penalty(&faceoff_airhockey::competition(), &report.outcomes[0])
    );
}

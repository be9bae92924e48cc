//! Datasets of real agents: independent of the number of workers, and verifiable by a new simulation.

use crate::{
    agents::{Agent, sandboxed_environment},
    recording::{moving_agent, read_table},
    shard::{run, spec},
};
use faceoff_airhockey::{DEFEND, HIT, PREPARE, simulator};
use faceoff_dataset::{
    Dataset, assemble,
    verify::{VerifiedDataset, verify},
};
use faceoff_types::{AgentFaultKind, Task, ViolationName};
use faceoff_wire::job::EvaluationMeta;
use std::{
    fs::File,
    num::NonZero,
    path::{Path, PathBuf},
};
use zip::ZipArchive;

/// All columns of a table except measured times and the columns derived from them.
fn columns_without_times(dir: &Path, table: &str) -> Vec<(String, arrow_array::ArrayRef)> {
    let batch = read_table(&dir.join(table));
    let schema = batch.schema();
    schema
        .fields()
        .iter()
        .zip(batch.columns())
        .map(|(field, column)| (field.name().clone(), column.clone()))
        .filter(|(name, _)| {
            !name.starts_with("computation_time")
                && name != "host_time_ns"
                && name != "cpu_time_ns"
                && name != "times_blake3"
                && name != "penalty_points"
        })
        .collect()
}

#[test]
fn recordings_of_one_and_three_workers_are_equal() {
    let dir = tempfile::tempdir().unwrap();
    let agent = moving_agent();
    // Plays the shards (ranges of episodes) with this number of workers.
    let play = |name: &str, shards: &[(u32, u32)], workers: usize| {
        let dirs: Vec<PathBuf> = shards
            .iter()
            .map(|(start, _)| dir.path().join(format!("{name}-{start}")))
            .collect();
        // Index of the next shard.
        let next = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    loop {
                        let index = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        let Some((start, end)) = shards.get(index) else {
                            break;
                        };
                        run(
                            &spec(DEFEND, *start..*end),
                            &agent,
                            &sandboxed_environment(),
                            &dirs[index],
                        )
                        .unwrap();
                    }
                });
            }
        });
        let archive = dir.path().join(format!("{name}.zip"));
        let mut result = assemble(&meta(), &dirs, &archive, None, simulator().as_ref())
            .unwrap()
            .result;
        let out = dir.path().join(name);
        let mut zip = ZipArchive::new(File::open(&archive).unwrap()).unwrap();
        zip.extract(&out).unwrap();
        // Only measured values may differ.
        let task = result.tasks.get_mut(&DEFEND).unwrap();
        task.computation_time_s = Default::default();
        task.violations.set(ViolationName::COMPUTATION_TIME, 0);
        (out, task.clone())
    };
    let (one, result_one) = play("one", &[(0, 6)], 1);
    let (three, result_three) = play("three", &[(0, 1), (1, 4), (4, 5), (5, 6)], 3);
    assert_eq!(result_one.successes, result_three.successes);
    assert_eq!(result_one.violations, result_three.violations);
    assert_eq!(result_one.steps, result_three.steps);
    for table in ["steps.parquet", "episodes.parquet"] {
        let (one, three) = (
            columns_without_times(&one, table),
            columns_without_times(&three, table),
        );
        assert!(one.len() > 30);
        assert_eq!(one, three, "{table}");
    }
}

fn meta() -> EvaluationMeta {
    let spec = spec(DEFEND, 0..1);
    EvaluationMeta {
        profile: spec.profile,
        seed: spec.seed,
        mismatch_seed: spec.mismatch_seed,
        agent: "test".into(),
        ruleset: faceoff_airhockey::RULESET,
        variation: Default::default(),
        task_weights: faceoff_airhockey::competition().weights(&Default::default()),
        tiers: faceoff_airhockey::competition().tiers,
    }
}

/// Runs one shard, and verifies its dataset by simulating it again.
fn play_and_verify(agent: &Agent, task: Task, episodes: u32) -> VerifiedDataset {
    let dir = tempfile::tempdir().unwrap();
    let shard = dir.path().join("shard");
    run(
        &spec(task, 0..episodes),
        agent,
        &sandboxed_environment(),
        &shard,
    )
    .unwrap();
    let archive = dir.path().join("dataset.zip");
    assemble(&meta(), &[shard], &archive, None, simulator().as_ref()).unwrap();
    let workers = NonZero::new(2).unwrap();
    verify(
        &Dataset::open(&archive, simulator().competition()).unwrap(),
        simulator().as_ref(),
        workers,
        &|| (),
    )
    .unwrap()
}

#[test]
fn recordings_with_faults_verify() {
    assert_eq!(play_and_verify(&moving_agent(), HIT, 2).episodes, 2);
    let agent = Agent::with_hooks(
        "now = 0\n\
         def on_reset(episode):\n    global now; now = episode\n    \
         if episode == 2: sys.exit(3)\n\
         def on_step(step, answer):\n    \
         return 'oops' if (now, step) == (1, 4) else json.dumps(answer)",
    );
    assert_eq!(play_and_verify(&agent, PREPARE, 4).episodes, 4);
    let failing = Agent::script("import sys\nsys.exit('no model')");
    assert_eq!(play_and_verify(&failing, HIT, 2).steps, 0);
}

#[test]
fn diverged_world_is_an_agent_fault_and_verifies() {
    let dir = tempfile::tempdir().unwrap();
    let shard = dir.path().join("shard");
    // Accelerates each joint in the direction in which it moves already.
    let agent = Agent::with_hooks(
        "INTERPOLATION = None\n\
         def on_hello(hello): print('start', file=sys.stderr)\n\
         def on_step(step, answer):\n    \
         push = [1e4 if dq > 0 else -1e4 for dq in obs[13:20]]\n    \
         answer['action'] = [[push, push, push]] * 20\n    \
         return json.dumps(answer)",
    );
    let report = run(
        &spec(PREPARE, 0..2),
        &agent,
        &sandboxed_environment(),
        &shard,
    )
    .unwrap();
    let faults: Vec<_> = report.outcomes.iter().map(|o| o.fault.clone()).collect();
    // The first world diverges; the second has extreme motion but stays finite.
    let [Some(fault), None] = &faults[..] else {
        panic!("{faults:?}");
    };
    assert!(
        matches!(fault.fault, AgentFaultKind::Diverged { .. }),
        "{fault}"
    );
    assert_eq!(fault.step, Some(report.outcomes[0].steps - 1));
    assert_eq!(report.log.matches("start\n").count(), 2, "{}", report.log);
    assert!(report.log.contains("made the simulated world diverge"));

    let archive = dir.path().join("dataset.zip");
    assemble(&meta(), &[shard], &archive, None, simulator().as_ref()).unwrap();
    let dataset = Dataset::open(&archive, simulator().competition()).unwrap();
    let workers = NonZero::new(2).unwrap();
    assert_eq!(
        verify(&dataset, simulator().as_ref(), workers, &|| ())
            .unwrap()
            .episodes,
        2
    );
    assert_eq!(dataset.episodes().unwrap()[0].outcome, report.outcomes[0]);
}

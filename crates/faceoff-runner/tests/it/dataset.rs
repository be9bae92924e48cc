use crate::{
    agents::{Agent, sandboxed},
    recording::{moving, read, seconds, texts},
    shard::{run, spec},
};
use faceoff_runner::{EvaluationMeta, PlatformFault, ShardReport, assemble};
use faceoff_types::{EpisodeOutcome, EvaluationResult, RULESET, Task};
use faceoff_wire::dataset::{DATASET_SCHEMA, DatasetManifest, ViolationsFile};
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};
use tempfile::TempDir;
use zip::ZipArchive;

/// Two tasks, one of them in three shards.
struct Evaluation {
    dir: TempDir,
    shards: Vec<PathBuf>,
    reports: Vec<ShardReport>,
    meta: EvaluationMeta,
}

impl Evaluation {
    fn play(agent: &Agent) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let (mut shards, mut reports) = (Vec::new(), Vec::new());
        for (task, range) in [
            (Task::Hit, 0..2),
            (Task::Prepare, 0..1),
            (Task::Prepare, 1..3),
            (Task::Prepare, 3..4),
        ] {
            let out = dir.path().join(format!("{task}-{}", range.start));
            reports.push(run(&spec(task, range), agent, &sandboxed(), &out).unwrap());
            shards.push(out);
        }
        let spec = spec(Task::Hit, 0..1);
        let meta = EvaluationMeta {
            profile: spec.profile,
            seed: spec.seed,
            mismatch_seed: spec.mismatch_seed,
            agent: "test".into(),
            ruleset: RULESET.into(),
        };
        Self {
            dir,
            shards,
            reports,
            meta,
        }
    }

    fn assemble(&self, name: &str) -> Result<(EvaluationResult, PathBuf), PlatformFault> {
        let archive = self.dir.path().join(name);
        assemble(&self.meta, &self.shards, &archive).map(|result| (result, archive))
    }

    #[track_caller]
    fn refused(&self, needle: &str) {
        match self.assemble("refused.zip") {
            Err(PlatformFault::Recording(message)) => {
                assert!(message.contains(needle), "{message:?} lacks {needle:?}");
            }
            other => panic!("{other:?}"),
        }
        assert!(!self.dir.path().join("refused.zip").exists());
    }
}

fn unzip(archive: &Path, into: &Path) -> Vec<String> {
    let mut zip = ZipArchive::new(File::open(archive).unwrap()).unwrap();
    zip.extract(into).unwrap();
    (0..zip.len())
        .map(|i| zip.by_index(i).unwrap().name().unwrap().into_owned())
        .collect()
}

fn json<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_dataset_is_whole_and_its_score_is_the_direct_one() {
    let mut evaluation = Evaluation::play(&moving());
    let (result, archive) = evaluation.assemble("one.zip").unwrap();

    // The shards' order does not matter, and nothing depends on the time of day.
    evaluation.shards.reverse();
    let (again, second) = evaluation.assemble("two.zip").unwrap();
    assert_eq!(result, again);
    assert!(
        fs::read(&archive).unwrap() == fs::read(second).unwrap(),
        "the same bytes"
    );

    let dir = evaluation.dir.path().join("dataset");
    let names = unzip(&archive, &dir);
    assert_eq!(
        names,
        [
            "steps.parquet",
            "episodes.parquet",
            "violations.json",
            "results.json",
            "agent.log",
            "manifest.json"
        ]
    );
    assert_eq!(json::<EvaluationResult>(&dir.join("results.json")), result);

    // Scored directly from the reports and the recorded times.
    let steps = read(&dir.join("steps.parquet"));
    let mut tasks = BTreeMap::new();
    for task in [Task::Hit, Task::Prepare] {
        let outcomes: Vec<EpisodeOutcome> = evaluation
            .reports
            .iter()
            .flat_map(|report| report.outcomes.iter().filter(|o| o.task == task).cloned())
            .collect();
        let of_task = texts(&steps, "task");
        let times = seconds(&steps, "computation_time_ns");
        let mut times: Vec<f64> = (0..steps.num_rows())
            .filter(|row| of_task.value(*row) == task.as_str())
            .map(|row| times[row])
            .collect();
        assert_eq!(
            times.len() as u64,
            outcomes.iter().map(|o| u64::from(o.steps)).sum::<u64>()
        );
        tasks.insert(task, faceoff_scoring::score_task(&outcomes, &mut times));
    }
    let meta = &evaluation.meta;
    assert_eq!(
        result,
        faceoff_scoring::score_evaluation(meta.profile, meta.seed, tasks)
    );

    let manifest: DatasetManifest = json(&dir.join("manifest.json"));
    assert_eq!(manifest.schema, DATASET_SCHEMA);
    assert_eq!(
        manifest.episodes,
        BTreeMap::from([(Task::Hit, 2), (Task::Prepare, 4)])
    );
    assert_eq!(
        (manifest.seed, manifest.mismatch_seed),
        (meta.seed, meta.mismatch_seed)
    );
    assert_eq!(manifest.files.len(), 5);
    for (name, digest) in &manifest.files {
        let bytes = fs::read(dir.join(name)).unwrap();
        assert_eq!(bytes.len() as u64, digest.bytes, "{name}");
        assert_eq!(
            blake3::hash(&bytes).to_hex().to_string(),
            digest.blake3,
            "{name}"
        );
    }
    let log = fs::read_to_string(dir.join("agent.log")).unwrap();
    assert!(log.starts_with("== hit, episodes 0 to 1 ==\ngoodbye\n== prepare, episodes 0 to 0 =="));
}

#[test]
fn violations_name_episode_and_step() {
    // Joint 1 swings to its limit: position, velocity and end effector are violated.
    let agent = Agent::with(
        "def on_step(step, answer):\n    \
         q = answer['action'][0]; q = [q[0] + 0.3 * step] + q[1:]\n    \
         return json.dumps({**answer, 'action': [q, [15.0] + [0.0] * 6]})",
    );
    let evaluation = Evaluation::play(&agent);
    let (_, archive) = evaluation.assemble("one.zip").unwrap();
    let dir = evaluation.dir.path().join("dataset");
    unzip(&archive, &dir);
    let file: ViolationsFile = json(&dir.join("violations.json"));
    for (task, found) in &file.tasks {
        let outcomes: Vec<&EpisodeOutcome> = evaluation
            .reports
            .iter()
            .flat_map(|report| &report.outcomes)
            .filter(|outcome| outcome.task == *task)
            .collect();
        let flagged = |flag: fn(&EpisodeOutcome) -> bool| -> Vec<u32> {
            outcomes
                .iter()
                .filter(|o| flag(o))
                .map(|o| o.episode)
                .collect()
        };
        for (listed, flagged) in [
            (&found.ee, flagged(|o| o.violations.ee)),
            (&found.link, flagged(|o| o.violations.link)),
            (&found.joint_pos, flagged(|o| o.violations.joint_pos)),
            (&found.joint_vel, flagged(|o| o.violations.joint_vel)),
        ] {
            assert_eq!(
                listed.iter().map(|v| v.episode).collect::<Vec<_>>(),
                flagged,
                "{task}"
            );
            assert!(listed.iter().all(|v| v.max > 0.0 && v.steps > 0));
        }
        assert_eq!(
            found.joint_vel.len(),
            outcomes.len(),
            "the swing is too fast in every episode"
        );
        assert!(
            found.joint_vel.iter().all(|v| v.first_step < 20),
            "{:?}",
            found.joint_vel
        );
    }
}

#[test]
fn what_is_missing_twice_or_foreign_is_refused() {
    let mut evaluation = Evaluation::play(&Agent::behaving());
    let whole = evaluation.shards.clone();
    evaluation.shards.remove(2);
    evaluation.refused("shard prepare 3..4 does not follow on episode 1");
    evaluation.shards = whole.clone();
    evaluation.shards.push(whole[2].clone());
    evaluation.refused("episodes are missing or twice");
    evaluation.shards = whole[2..].to_vec();
    evaluation.refused("shard prepare 1..3 does not follow on episode 0");
    evaluation.shards = Vec::new();
    evaluation.refused("an evaluation without shards");
    evaluation.shards = whole;
    evaluation.meta.seed = evaluation.meta.seed.model_mismatch();
    evaluation.refused("belongs to another evaluation");
    evaluation.meta.ruleset = "airhockey-1999".into();
    evaluation.refused("played by airhockey-1999");
}

#[test]
fn damaged_recordings_are_found() {
    let evaluation = Evaluation::play(&Agent::behaving());
    let shard = &evaluation.shards[1];
    for name in [
        "steps.parquet",
        "episodes.parquet",
        "report.json",
        "agent.log",
    ] {
        let path = shard.join(name);
        let good = fs::read(&path).unwrap();
        let mut flipped = good.clone();
        flipped[good.len() / 2] ^= 1;
        fs::write(&path, &flipped).unwrap();
        evaluation.refused(&format!("damaged or incomplete: {name} has"));
        fs::write(&path, &good[..good.len() - 1]).unwrap();
        evaluation.refused(&format!("damaged or incomplete: {name} has"));
        fs::remove_file(&path).unwrap();
        evaluation.refused(&format!("{name} is missing"));
        fs::write(&path, &good).unwrap();
    }
    let path = shard.join("shard.json");
    let good = fs::read(&path).unwrap();
    fs::write(&path, &good[..good.len() / 2]).unwrap();
    evaluation.refused("damaged or incomplete: shard.json");
    fs::remove_file(&path).unwrap();
    evaluation.refused("damaged or incomplete: shard.json");
    fs::write(&path, &good).unwrap();
    evaluation.assemble("whole.zip").unwrap();
    assert!(evaluation.dir.path().join("whole.zip").exists());
}

#[test]
fn an_evaluation_stopped_by_faults_has_no_score() {
    let evaluation = Evaluation::play(&Agent::behaving());
    let agent = Agent::with("def on_step(step, answer): sys.exit(1)");
    run(
        &spec(Task::Prepare, 0..4),
        &agent,
        &sandboxed(),
        &evaluation.shards[1],
    )
    .unwrap();
    evaluation.refused("there is no score");
}

#[test]
fn the_archive_is_read_by_others() {
    let evaluation = Evaluation::play(&Agent::behaving());
    let (_, archive) = evaluation.assemble("one.zip").unwrap();
    let mut text = String::new();
    let mut zip = ZipArchive::new(File::open(archive).unwrap()).unwrap();
    zip.by_name("results.json")
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let keys = |value: &serde_json::Value| -> Vec<String> {
        let mut keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort();
        keys
    };
    assert_eq!(
        keys(&value),
        [
            "penalty_points",
            "profile",
            "ruleset",
            "score",
            "seed",
            "tasks",
            "tier"
        ]
    );
    assert_eq!(keys(&value["tasks"]), ["hit", "prepare"]);
    assert_eq!(
        keys(&value["tasks"]["hit"]),
        [
            "computation_time_s",
            "episodes",
            "penalty_points",
            "steps",
            "success_ci95",
            "success_rate",
            "successes",
            "tier",
            "violations"
        ]
    );
}

/// Everything in the tables but the two columns of measured times and what follows from them.
fn timeless_columns(dir: &Path, table: &str) -> Vec<(String, arrow_array::ArrayRef)> {
    let batch = read(&dir.join(table));
    let schema = batch.schema();
    schema
        .fields()
        .iter()
        .zip(batch.columns())
        .map(|(field, column)| (field.name().clone(), column.clone()))
        .filter(|(name, _)| {
            !name.starts_with("computation_time")
                && name != "cpu_time_ns"
                && name != "times_blake3"
                && name != "penalty_points"
        })
        .collect()
}

#[test]
fn one_worker_and_three_record_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let agent = moving();
    let play = |name: &str, shards: &[(u32, u32)], workers: usize| {
        let dirs: Vec<PathBuf> = shards
            .iter()
            .map(|(start, _)| dir.path().join(format!("{name}-{start}")))
            .collect();
        let next = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    loop {
                        let at = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        let Some((start, end)) = shards.get(at) else {
                            break;
                        };
                        run(
                            &spec(Task::Defend, *start..*end),
                            &agent,
                            &sandboxed(),
                            &dirs[at],
                        )
                        .unwrap();
                    }
                });
            }
        });
        let spec = spec(Task::Defend, 0..1);
        let meta = EvaluationMeta {
            profile: spec.profile,
            seed: spec.seed,
            mismatch_seed: spec.mismatch_seed,
            agent: "test".into(),
            ruleset: RULESET.into(),
        };
        let archive = dir.path().join(format!("{name}.zip"));
        let mut result = assemble(&meta, &dirs, &archive).unwrap();
        let out = dir.path().join(name);
        unzip(&archive, &out);
        // What is measured may differ; nothing else may.
        let task = result.tasks.get_mut(&Task::Defend).unwrap();
        task.computation_time_s = Default::default();
        task.violations.computation_time = 0;
        (out, task.clone())
    };
    let (one, result_one) = play("one", &[(0, 6)], 1);
    let (three, result_three) = play("three", &[(0, 1), (1, 4), (4, 5), (5, 6)], 3);
    assert_eq!(result_one.successes, result_three.successes);
    assert_eq!(result_one.violations, result_three.violations);
    assert_eq!(result_one.steps, result_three.steps);
    for table in ["steps.parquet", "episodes.parquet"] {
        let (one, three) = (
            timeless_columns(&one, table),
            timeless_columns(&three, table),
        );
        assert!(one.len() > 30);
        assert_eq!(one, three, "{table}");
    }
}

//! Tests of joining shards (recordings of ranges of episodes) to a dataset, and of its score.

use crate::recordings::{Agent, Evaluation, hold_still, json, play, spec, swing_arm, table, unzip};
use arrow_array::{StringArray, cast::AsArray, types::Int64Type};
use faceoff_airhockey::{EE, HIT, JOINT_POS, JOINT_VEL, LINK, PREPARE};
use faceoff_dataset::RecordingError;
use faceoff_scoring::StepTimes;
use faceoff_types::{EpisodeOutcome, EvaluationResult, SlotTiming, TaskMap};
use faceoff_wire::dataset::{CalibrationFile, DATASET_SCHEMA, DatasetManifest, ViolationsFile};
use std::{
    fs::{self, File},
    io::Read,
    time::Duration,
};
use zip::ZipArchive;

/// Two tasks, one of them in three shards.
fn two_tasks(agent: Agent) -> Evaluation {
    let shards = [
        (HIT, 0..2),
        (PREPARE, 0..1),
        (PREPARE, 1..3),
        (PREPARE, 3..4),
    ];
    Evaluation::play(Some(agent), &shards)
}

/// Asserts that assembling fails with a message that contains `needle`.
#[track_caller]
fn assert_refused(evaluation: &Evaluation, needle: &str) {
    match evaluation.assemble("refused.zip") {
        Err(RecordingError::Unusable(message)) => {
            assert!(message.contains(needle), "{message:?} lacks {needle:?}");
        }
        other => panic!("{other:?}"),
    }
    // No archive is left, complete or not.
    let entries = evaluation.dir.path().read_dir().unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name());
    assert_eq!(
        names
            .filter(|name| name.to_string_lossy().contains(".zip"))
            .count(),
        0
    );
}

#[test]
fn dataset_is_complete_and_score_matches_the_reports() {
    let mut evaluation = two_tasks(swing_arm);
    let (dataset, archive) = evaluation.assemble("one.zip").unwrap();
    let result = dataset.result.clone();

    // Neither the shards' order nor the time has an effect.
    evaluation.shards.reverse();
    let (second_dataset, second_archive) = evaluation.assemble("two.zip").unwrap();
    assert_eq!(dataset, second_dataset);
    let bytes = fs::read(&archive).unwrap();
    assert!(bytes == fs::read(second_archive).unwrap(), "the same bytes");
    assert_eq!(
        (dataset.archive.bytes, dataset.archive.blake3),
        (
            bytes.len() as u64,
            blake3::hash(&bytes).to_hex().to_string()
        )
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
            "calibration.json",
            "agent.log",
            "manifest.json"
        ]
    );
    assert_eq!(json::<EvaluationResult>(&dir.join("results.json")), result);

    // Scored directly from the reports and the recorded times.
    let steps = table(&dir.join("steps.parquet"));
    let mut tasks = TaskMap::new();
    let meta_bounds = evaluation.meta.tier_bounds();
    for task in [HIT, PREPARE] {
        let outcomes: Vec<EpisodeOutcome> = evaluation
            .reports
            .iter()
            .flat_map(|report| report.outcomes.iter().filter(|o| o.task == task).cloned())
            .collect();
        let step_tasks: &StringArray = steps["task"].as_string();
        let nanoseconds = steps["computation_time_ns"].as_primitive::<Int64Type>();
        let mut times = StepTimes::for_steps(outcomes.iter().map(|o| u64::from(o.steps)).sum());
        for row in (0..steps.num_rows()).filter(|row| step_tasks.value(*row) == task.as_str()) {
            let time = Duration::from_nanos(nanoseconds.value(row).unsigned_abs());
            times.add(time.as_secs_f64());
        }
        tasks.insert(
            task,
            faceoff_scoring::score_task(
                &faceoff_airhockey::competition(),
                &outcomes,
                &times,
                meta_bounds,
            ),
        );
    }
    let meta = &evaluation.meta;
    let direct = EvaluationResult {
        timing: result.timing,
        ..faceoff_scoring::score_evaluation(
            meta.ruleset,
            meta.profile,
            meta.seed,
            &Default::default(),
            &meta.task_weights,
            meta_bounds,
            tasks,
        )
    };
    assert_eq!(result, direct);

    let manifest: DatasetManifest = json(&dir.join("manifest.json"));
    assert_eq!(manifest.schema, DATASET_SCHEMA);
    assert_eq!(manifest.episodes, TaskMap::from([(HIT, 2), (PREPARE, 4)]));
    assert_eq!(
        (manifest.seed, manifest.mismatch_seed),
        (meta.seed, meta.mismatch_seed)
    );
    assert_eq!(manifest.files.len(), 6);
    for (name, digest) in &manifest.files {
        let bytes = fs::read(dir.join(name)).unwrap();
        assert_eq!(bytes.len() as u64, digest.bytes, "{name}");
        assert_eq!(
            blake3::hash(&bytes).to_hex().to_string(),
            digest.blake3,
            "{name}"
        );
    }
    let calibration: CalibrationFile = json(&dir.join("calibration.json"));
    let shards = &calibration.shards;
    let ranges: Vec<_> = shards
        .iter()
        .map(|shard| (shard.task, shard.first_episode, shard.end_episode))
        .collect();
    assert_eq!(ranges[0], (HIT, 0, 2));
    let worst = shards
        .iter()
        .map(|shard| shard.timing)
        .reduce(SlotTiming::worse);
    assert_eq!(result.timing, worst);
    assert!(worst.unwrap().before_s.p50 > 0.0);
    let log = fs::read_to_string(dir.join("agent.log")).unwrap();
    assert!(log.starts_with("== hit, episodes 0 to 1 ==\ngoodbye\n== prepare, episodes 0 to 0 =="));
}

#[test]
fn violations_name_episode_and_step() {
    // Joint 1 swings to its limit: position, velocity and end effector are violated.
    let evaluation = two_tasks(|question| {
        let mut action = [question.initial_joints, [0.0; 7]];
        action[0][0] += 0.3 * f64::from(question.step.unwrap_or(0));
        action[1][0] = 15.0;
        Some(action)
    });
    let (_, archive) = evaluation.assemble("one.zip").unwrap();
    let dir = evaluation.dir.path().join("dataset");
    unzip(&archive, &dir);
    let file: ViolationsFile = json(&dir.join("violations.json"));
    for (task, violations) in &file.tasks {
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
        for (name, flagged) in [
            (EE, flagged(|o| o.violations.contains(EE))),
            (LINK, flagged(|o| o.violations.contains(LINK))),
            (JOINT_POS, flagged(|o| o.violations.contains(JOINT_POS))),
            (JOINT_VEL, flagged(|o| o.violations.contains(JOINT_VEL))),
        ] {
            let listed = &violations.constraints[&name];
            assert_eq!(
                listed.iter().map(|v| v.episode).collect::<Vec<_>>(),
                flagged,
                "{task}"
            );
            assert!(listed.iter().all(|v| v.max > 0.0 && v.steps > 0));
        }
        assert_eq!(
            violations.constraints[&JOINT_VEL].len(),
            outcomes.len(),
            "the swing is too fast in every episode"
        );
        assert!(
            violations.constraints[&JOINT_VEL]
                .iter()
                .all(|v| v.first_step < 20),
            "{:?}",
            violations.constraints[&JOINT_VEL]
        );
    }
}

#[test]
fn missing_repeated_and_foreign_shards_are_refused() {
    let mut evaluation = two_tasks(hold_still);
    let all_shards = evaluation.shards.clone();
    evaluation.shards.remove(2);
    assert_refused(
        &evaluation,
        "shard prepare 3..4 does not start at episode 1",
    );
    evaluation.shards = all_shards.clone();
    evaluation.shards.push(all_shards[2].clone());
    assert_refused(&evaluation, "episodes are missing or recorded twice");
    evaluation.shards = all_shards[2..].to_vec();
    assert_refused(
        &evaluation,
        "shard prepare 1..3 does not start at episode 0",
    );
    evaluation.shards = Vec::new();
    assert_refused(&evaluation, "an evaluation without shards");
    evaluation.shards = all_shards;
    evaluation.meta.ruleset = faceoff_airhockey::RULESETS[0];
    assert_refused(
        &evaluation,
        "was played by airhockey-2023.3, the evaluation by airhockey-2023.1",
    );
    evaluation.meta.seed = evaluation.meta.seed.model_mismatch();
    assert_refused(&evaluation, "belongs to another evaluation");
}

#[test]
fn damaged_shards_are_refused() {
    let evaluation = two_tasks(hold_still);
    let shard = &evaluation.shards[1];
    for name in [
        "steps.parquet",
        "episodes.parquet",
        "report.json",
        "agent.log",
    ] {
        let path = shard.join(name);
        let intact = fs::read(&path).unwrap();
        let mut flipped = intact.clone();
        flipped[intact.len() / 2] ^= 1;
        fs::write(&path, &flipped).unwrap();
        assert_refused(&evaluation, &format!("damaged or incomplete: {name} has"));
        fs::write(&path, &intact[..intact.len() - 1]).unwrap();
        assert_refused(&evaluation, &format!("damaged or incomplete: {name} has"));
        fs::remove_file(&path).unwrap();
        assert_refused(&evaluation, &format!("{name} is missing"));
        fs::write(&path, &intact).unwrap();
    }
    let path = shard.join("shard.json");
    let intact = fs::read(&path).unwrap();
    fs::write(&path, &intact[..intact.len() / 2]).unwrap();
    assert_refused(&evaluation, "damaged or incomplete: shard.json");
    fs::remove_file(&path).unwrap();
    assert_refused(&evaluation, "damaged or incomplete: shard.json");
    // It would be read whole.
    let text = String::from_utf8(intact.clone()).unwrap();
    fs::write(&path, text.clone() + &" ".repeat(1 << 20)).unwrap();
    assert_refused(&evaluation, "shard.json: larger than 1048576 bytes");
    let schema = text.replace("faceoff-shard/5", &"long".repeat(10_000));
    fs::write(&path, schema).unwrap();
    let Err(error) = evaluation.assemble("dataset.zip") else {
        panic!("a shard of an unknown layout is refused");
    };
    let error = error.to_string();
    assert!(error.contains("its layout is \"longlong"), "{error}");
    assert!(error.len() < 1000, "{} bytes", error.len());
    fs::write(&path, &intact).unwrap();
    evaluation.assemble("whole.zip").unwrap();
    assert!(evaluation.dir.path().join("whole.zip").exists());
}

#[test]
fn evaluation_stopped_by_faults_has_no_score() {
    let evaluation = two_tasks(hold_still);
    let faults_in_first_step: Agent = |question| {
        question
            .step
            .is_none()
            .then_some([question.initial_joints, [0.0; 7]])
    };
    play(
        &spec(PREPARE, 0..4),
        Some(faults_in_first_step),
        &evaluation.shards[1],
    );
    assert_refused(&evaluation, "there is no score");
}

#[test]
fn results_json_has_the_documented_fields() {
    let evaluation = two_tasks(hold_still);
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
            "tier",
            "timing"
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

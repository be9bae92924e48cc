//! Verification of datasets: forged recordings with matching hashes are found.

use crate::{
    forgery::{Forgery, concat, flipped},
    recordings::{Agent, Evaluation, Question, spec, swing_arm, table},
};
use arrow_array::{
    Array, Float64Array, ListArray, RecordBatch, StringArray, UInt32Array,
    builder::{Float64Builder, ListBuilder},
    cast::AsArray,
};
use arrow_schema::DataType;
use faceoff_airhockey::{DEFEND, HIT, PREPARE, simulator};
use faceoff_dataset::{
    Dataset, DatasetError, EpisodeRecord,
    verify::{Difference, SeasonClaim, VerifiedDataset, VerifyError, verify},
};
use faceoff_types::{EvaluationResult, Seed};
use faceoff_wire::dataset::DatasetManifest;
use std::{
    fs,
    num::NonZero,
    path::Path,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicU32, Ordering},
    },
};

/// One recording of two tasks for all tests that only read it.
fn played() -> &'static Evaluation {
    static PLAYED: OnceLock<Evaluation> = OnceLock::new();
    PLAYED.get_or_init(|| {
        let shards = [(HIT, 0..1), (HIT, 1..2), (DEFEND, 0..2)];
        Evaluation::play(Some(swing_arm), &shards).assembled()
    })
}

fn forgery() -> Forgery {
    Forgery::copy_of(&played().folder())
}

/// Opens and verifies a dataset on `threads` threads.
pub fn check(path: &Path, threads: usize) -> Result<VerifiedDataset, VerifyError> {
    verify(
        &Dataset::open(path, simulator().competition())?,
        simulator().as_ref(),
        NonZero::new(threads).unwrap(),
        &|| (),
    )
}

/// The difference that a verification with this number of threads finds.
#[track_caller]
fn difference(path: &Path, threads: usize) -> Difference {
    match check(path, threads) {
        Err(VerifyError::Differs(difference)) => *difference,
        other => panic!("{other:?}"),
    }
}

/// Names of the columns of a table.
fn column_names(file: &str) -> Vec<String> {
    let batch = table(&played().folder().join(file));
    let schema = batch.schema();
    schema
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect()
}

#[test]
fn recording_verifies_zipped_unzipped_with_any_threads() {
    let played = played();
    let progress_calls = AtomicU32::new(0);
    let dataset = Dataset::open(&played.archive(), simulator().competition()).unwrap();
    let verified = verify(
        &dataset,
        simulator().as_ref(),
        NonZero::<usize>::MIN,
        &|| {
            progress_calls.fetch_add(1, Ordering::Relaxed);
        },
    )
    .unwrap();
    assert_eq!((verified.episodes, progress_calls.into_inner()), (4, 4));
    assert_eq!(verified.result, dataset.results().unwrap());
    assert_eq!(
        verified.steps,
        verified
            .result
            .tasks
            .values()
            .map(|task| task.steps)
            .sum::<u64>()
    );
    assert_eq!(check(&played.folder(), 8).unwrap(), verified);
    assert_eq!(
        check(played.dir.path(), 3).unwrap(),
        verified,
        "as `faceoff eval` leaves it"
    );
    // A table rewritten by another program with the same numbers verifies too.
    let rewritten = forgery();
    rewritten.change_table("steps.parquet", |batch| batch);
    assert_eq!(
        check(rewritten.update_manifest().dir.path(), 2).unwrap(),
        verified
    );
}

#[test]
fn panic_in_a_thread_ends_the_verification() {
    let dataset = Dataset::open(&played().archive(), simulator().competition()).unwrap();
    let panic = std::panic::catch_unwind(|| {
        verify(
            &dataset,
            simulator().as_ref(),
            NonZero::<usize>::MIN,
            &|| panic!("stop here"),
        )
        .unwrap()
    })
    .unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"stop here"));
}

#[test]
fn flipped_bit_in_any_step_column_is_located() {
    let steps = table(&played().folder().join("steps.parquet"));
    // A step in the middle of `hit`, episode 1.
    let tasks: &StringArray = steps["task"].as_string();
    let episodes: &UInt32Array = steps["episode"].as_primitive();
    let start = (0..steps.num_rows())
        .find(|row| tasks.value(*row) == "hit" && episodes.value(*row) == 1)
        .unwrap();
    let row = start + 17;
    for name in column_names("steps.parquet") {
        let forgery = forgery();
        forgery.change_table("steps.parquet", |batch| flipped(&batch, &name, row));
        let found = difference(forgery.update_manifest().dir.path(), 2);
        assert_eq!(
            (found.task, found.episode),
            (Some(HIT), Some(1)),
            "{name}: {found}"
        );
        match name.as_str() {
            // The hashes of actions and times detect changes without effect on other numbers.
            "computation_time_ns" | "host_time_ns" | "cpu_time_ns" => {
                assert_eq!(found.step, None, "{found}");
                let fields = ["computation_time_mean_s", "times_blake3"];
                assert!(fields.contains(&found.field.as_str()), "{found}");
            }
            "action" => {
                let digest = found.field == "actions_blake3" && found.step.is_none();
                assert!(digest || found.step >= Some(17), "{found}");
            }
            _ => assert_eq!((found.step, &found.field), (Some(17), &name), "{found}"),
        }
    }
}

#[test]
fn changed_action_is_found_at_its_step() {
    let forgery = forgery();
    forgery.change_table("steps.parquet", |batch| {
        let (index, _) = batch
            .schema()
            .column_with_name("action")
            .map(|(index, field)| (index, field.clone()))
            .unwrap();
        let column: &ListArray = batch.column(index).as_list();
        let DataType::List(item) = column.data_type() else {
            panic!("actions are lists");
        };
        let mut out = ListBuilder::new(Float64Builder::new()).with_field(item.clone());
        for step in 0..column.len() {
            let values = column.value(step);
            let values: &Float64Array = values.as_primitive();
            for (index, value) in values.values().iter().enumerate() {
                let is_changed = (step, index) == (5, 0);
                out.values()
                    .append_value(value + if is_changed { 1e-9 } else { 0.0 });
            }
            out.append(true);
        }
        let mut columns = batch.columns().to_vec();
        columns[index] = Arc::new(out.finish());
        RecordBatch::try_new(batch.schema(), columns).unwrap()
    });
    let forgery = forgery.update_manifest();
    let found = difference(forgery.dir.path(), 1);
    assert_eq!(
        (found.task, found.episode, found.step),
        (Some(HIT), Some(0), Some(5))
    );
    assert!(
        found
            .to_string()
            .starts_with("steps.parquet, hit, episode 0, step 5, "),
        "{found}"
    );
    assert_eq!(
        found,
        difference(forgery.dir.path(), 8),
        "on any number of threads"
    );
}

#[test]
fn flipped_bit_in_any_episode_column_is_found() {
    for name in column_names("episodes.parquet") {
        // The opponent's columns are absent in `defend`: take `hit`.
        let forgery = forgery();
        forgery.change_table("episodes.parquet", |batch| flipped(&batch, &name, 1));
        let found = difference(forgery.update_manifest().dir.path(), 2);
        if name == "host_noise_reruns" {
            // Only the total in the timing measurements of the slots shows the change.
            assert_eq!((&found.field, found.file), (&name, "calibration.json"));
            continue;
        }
        assert_eq!(
            (found.task, found.episode),
            (Some(HIT), Some(1)),
            "{name}: {found}"
        );
        match name.as_str() {
            // With another interpolation the recorded actions are invalid; with other steps, rows are missing.
            "interpolation" => assert_eq!(found.file, "steps.parquet", "{found}"),
            "steps" => {}
            _ => assert_eq!(
                (&found.field, found.file),
                (&name, "episodes.parquet"),
                "{found}"
            ),
        }
    }
}

#[test]
fn forged_scores_are_found() {
    for (name, from, to, field) in [
        (
            "results.json",
            "\"successes\": ",
            "\"successes\": 1",
            "tasks.hit.successes",
        ),
        ("results.json", "\"score\": ", "\"score\": 1", "score"),
        (
            "results.json",
            "\"tier\": \"",
            "\"tier\": \"x",
            "tasks.hit.tier",
        ),
        ("results.json", "{\n", "{ \n", "byte 1"),
        (
            "violations.json",
            "\"joint_pos\": []",
            "\"joint_pos\": [7]",
            "tasks.hit.joint_pos[0]",
        ),
    ] {
        let forgery = forgery();
        forgery.replace_text(name, from, to);
        // The hash shows the change; with updated hashes, the simulation does.
        match Dataset::open(forgery.dir.path(), simulator().competition()) {
            Err(DatasetError::Altered(message)) => assert!(message.starts_with(name), "{message}"),
            other => panic!("{other:?}"),
        }
        let found = difference(forgery.update_manifest().dir.path(), 2);
        assert_eq!(found.file, name);
        assert_eq!(found.field, field, "{found}");
    }
}

#[test]
fn forged_seeds_and_profiles_are_found() {
    let seed = spec(HIT, 0..1).seed;
    for (from, to) in [
        (seed.to_string(), Seed::from_number(8).to_string()),
        (seed.model_mismatch().to_string(), seed.to_string()),
        (
            "\"profile\": \"evaluation\"".into(),
            "\"profile\": \"ideal\"".into(),
        ),
    ] {
        let forgery = forgery();
        forgery.replace_text("manifest.json", &from, &to);
        let found = difference(forgery.dir.path(), 2);
        assert_eq!(
            (found.task, found.episode, found.step),
            (Some(HIT), Some(0), Some(0)),
            "{found}"
        );
    }
}

#[test]
fn missing_repeated_and_surplus_rows_are_found() {
    let without_row = |table: &str, row: usize| {
        let forgery = forgery();
        forgery.change_table(table, |batch| {
            let parts = [
                batch.slice(0, row),
                batch.slice(row + 1, batch.num_rows() - row - 1),
            ];
            concat(&parts)
        });
        difference(forgery.update_manifest().dir.path(), 2)
    };
    let with_row_twice = |table: &str, row: usize| {
        let forgery = forgery();
        forgery.change_table(table, |batch| {
            concat(&[
                batch.slice(0, row + 1),
                batch.slice(row, batch.num_rows() - row),
            ])
        });
        difference(forgery.update_manifest().dir.path(), 2)
    };
    let last = table(&played().folder().join("steps.parquet")).num_rows() - 1;
    let location = |found: &Difference| (found.task, found.episode, found.step);
    let (hit, defend) = (Some(HIT), Some(DEFEND));
    assert_eq!(
        location(&without_row("steps.parquet", 3)),
        (hit, Some(0), Some(3))
    );
    assert_eq!(
        location(&with_row_twice("steps.parquet", 3)),
        (hit, Some(0), Some(4))
    );
    let found = without_row("steps.parquet", last);
    assert_eq!((found.task, found.episode), (defend, Some(1)), "{found}");
    let found = with_row_twice("steps.parquet", last);
    assert_eq!(
        (found.task, found.episode, &*found.field),
        (defend, Some(1), "rows")
    );
    let found = without_row("episodes.parquet", 1);
    assert_eq!(
        (location(&found), &*found.field),
        ((hit, Some(1), None), "task")
    );
    let found = with_row_twice("episodes.parquet", 0);
    assert_eq!(
        (location(&found), &*found.field),
        ((hit, Some(1), None), "episode")
    );
    let found = without_row("episodes.parquet", 3);
    assert_eq!(
        (location(&found), &*found.recorded),
        ((defend, Some(1), None), "nothing")
    );
    let found = with_row_twice("episodes.parquet", 3);
    assert_eq!(
        (location(&found), &*found.field),
        ((defend, Some(1), None), "rows")
    );
}

/// The contents of a dataset for a reader.
fn contents(dataset: &Dataset) -> (EvaluationResult, Vec<EpisodeRecord>, DatasetManifest) {
    let episodes = dataset.episodes().unwrap();
    (
        dataset.results().unwrap(),
        episodes,
        dataset.manifest().clone(),
    )
}

#[test]
fn damaged_archive_is_refused_or_has_intact_files() {
    let intact = fs::read(played().archive()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("dataset.zip");
    let whole = Dataset::open(&played().archive(), simulator().competition()).unwrap();
    let hash = whole.archive().unwrap().unwrap().blake3;
    let whole = contents(&whole);
    // Every byte at both ends, where the archive's structure is, and some of the rest.
    let tail = intact.len() - 2048;
    let offsets = (0..128)
        .chain((128..tail).step_by(tail / 200))
        .chain(tail..intact.len());
    for offset in offsets {
        let mut bytes = intact.clone();
        bytes[offset] ^= 1 << (offset % 8);
        fs::write(&path, &bytes).unwrap();
        match Dataset::open(&path, simulator().competition()) {
            Err(DatasetError::Altered(_) | DatasetError::Unreadable(_)) => {}
            Err(other) => panic!("byte {offset} flipped: {other:?}"),
            Ok(dataset) => {
                assert_eq!(contents(&dataset), whole, "byte {offset} flipped");
                assert_ne!(dataset.archive().unwrap().unwrap().blake3, hash);
            }
        }
    }
    for length in [
        0,
        1,
        100,
        intact.len() / 2,
        intact.len() - 100,
        intact.len() - 1,
    ] {
        fs::write(&path, &intact[..length]).unwrap();
        let refused = Dataset::open(&path, simulator().competition());
        assert!(
            matches!(
                refused,
                Err(DatasetError::Altered(_) | DatasetError::Unreadable(_))
            ),
            "{length} bytes"
        );
    }
}

#[test]
fn lazily_opened_files_are_checked_when_read() {
    let forgery = forgery();
    for name in [
        "steps.parquet",
        "episodes.parquet",
        "results.json",
        "calibration.json",
    ] {
        let intact = fs::read(forgery.path(name)).unwrap();
        let mut bytes = intact.clone();
        bytes[intact.len() / 2] ^= 1;
        fs::write(forgery.path(name), &bytes).unwrap();
        let dataset = Dataset::open_lazily(forgery.dir.path(), simulator().competition()).unwrap();
        let read = [
            ("steps.parquet", dataset.steps().map(|_| ())),
            ("episodes.parquet", dataset.episodes().map(|_| ())),
            ("results.json", dataset.results().map(|_| ())),
            ("calibration.json", dataset.calibration().map(|_| ())),
        ];
        for (file, read) in read {
            match read {
                Err(DatasetError::Altered(message)) => {
                    assert!(file == name && message.starts_with(name), "{message}");
                }
                other => assert!(other.is_ok() && file != name, "{file}: {other:?}"),
            }
        }
        fs::write(forgery.path(name), &intact).unwrap();
    }
}

#[test]
fn damaged_files_in_a_folder_are_refused() {
    for name in [
        "steps.parquet",
        "episodes.parquet",
        "agent.log",
        "results.json",
    ] {
        let forgery = forgery();
        let intact = fs::read(forgery.path(name)).unwrap();
        for offset in (0..intact.len()).step_by(intact.len().div_ceil(40)) {
            let mut bytes = intact.clone();
            bytes[offset] ^= 0x10;
            fs::write(forgery.path(name), &bytes).unwrap();
            match Dataset::open(forgery.dir.path(), simulator().competition()) {
                Err(DatasetError::Altered(text)) => assert!(text.starts_with(name), "{text}"),
                other => panic!("{name}, byte {offset}: {other:?}"),
            }
        }
        fs::remove_file(forgery.path(name)).unwrap();
        assert!(
            Dataset::open(forgery.dir.path(), simulator().competition()).is_err(),
            "{name} is missing"
        );
    }
    // A truncated table with a matching hash is unreadable.
    let forgery = forgery();
    let steps = fs::read(forgery.path("steps.parquet")).unwrap();
    fs::write(forgery.path("steps.parquet"), &steps[..steps.len() / 2]).unwrap();
    let result = check(forgery.update_manifest().dir.path(), 2);
    assert!(
        matches!(
            result,
            Err(VerifyError::Dataset(DatasetError::Unreadable(_)))
        ),
        "{result:?}"
    );
}

#[test]
fn foreign_layouts_rulesets_and_simulators_are_named() {
    let fingerprint = Dataset::open(&played().archive(), simulator().competition())
        .unwrap()
        .manifest()
        .simulator
        .fingerprint
        .clone();
    for (from, to, expected) in [
        (
            "faceoff-dataset/4",
            "faceoff-dataset/1",
            "layout is \"faceoff-dataset/1\"",
        ),
        (
            "airhockey-2023.3",
            "airhockey-1999",
            "unknown ruleset \"airhockey-1999\": this version knows airhockey-2023.1, airhockey-2023.2, \
             airhockey-2023.3",
        ),
        (
            &*fingerprint,
            "00",
            "verify it with the version that made it",
        ),
    ] {
        let forgery = forgery();
        forgery.replace_text("manifest.json", from, to);
        match check(forgery.dir.path(), 1) {
            Err(VerifyError::Dataset(DatasetError::Foreign(message))) => {
                assert!(message.contains(expected), "{message}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn datasets_of_earlier_rulesets_verify() {
    for earlier in ["airhockey-2023.1", "airhockey-2023.2"] {
        let forgery = forgery();
        for name in ["manifest.json", "results.json"] {
            forgery.replace_text(name, "airhockey-2023.3", earlier);
        }
        let verified = check(forgery.update_manifest().dir.path(), 2).unwrap();
        assert_eq!(verified.result.ruleset, earlier);
        assert_eq!(verified.episodes, 4);
    }
}

#[test]
fn datasets_with_agent_faults_verify() {
    let agent: Agent = |question| match (question.episode, question.step) {
        (1, Some(4)) | (2, None) => None,
        _ => Some([question.initial_joints, [0.0; 7]]),
    };
    let faulty = Evaluation::play(Some(agent), &[(PREPARE, 0..4)]).assembled();
    let verified = check(&faulty.archive(), 2).unwrap();
    assert_eq!(verified.episodes, 4);
    let violations = &verified.result.tasks[&PREPARE].violations;
    assert_eq!(
        violations.get(faceoff_types::ViolationName::COMPUTATION_TIME),
        2,
        "the two faults"
    );
    let never_started = Evaluation::play(None, &[(HIT, 0..2)]).assembled();
    assert_eq!(check(&never_started.archive(), 1).unwrap().steps, 0);
}

#[test]
fn seeds_follow_from_the_revealed_secret() {
    let day = "2026-11-21".parse().unwrap();
    let secret = Seed::from_number(42);
    let mut manifest = Dataset::open(&played().archive(), simulator().competition())
        .unwrap()
        .manifest()
        .clone();
    manifest.seed = secret.day(day);
    manifest.mismatch_seed = secret.model_mismatch();
    let claim = SeasonClaim {
        stage: None,
        secret,
        commitment: Some(blake3::hash(secret.as_bytes()).to_hex().to_uppercase()),
        day,
    };
    assert_eq!(claim.check(&manifest), Ok(()));
    let failed_claim =
        |claim: &SeasonClaim, manifest: &DatasetManifest| claim.check(manifest).unwrap_err().claim;
    let other_day = SeasonClaim {
        day: "2026-11-22".parse().unwrap(),
        ..claim.clone()
    };
    assert_eq!(failed_claim(&other_day, &manifest), "the evaluation's seed");
    let wrong_commitment = SeasonClaim {
        commitment: Some("00".repeat(32)),
        ..claim.clone()
    };
    assert_eq!(failed_claim(&wrong_commitment, &manifest), "the commitment");
    manifest.mismatch_seed = manifest.seed;
    assert_eq!(
        failed_claim(&claim, &manifest),
        "the seed of the model mismatch"
    );
}

/// An agent that commands extreme positions from its 4th step on.
fn command_extremes(question: &Question) -> Option<[[f64; 7]; 2]> {
    let step = question.step.unwrap_or(0);
    let sign = if step.is_multiple_of(2) { 1e4 } else { -1e4 };
    Some(match (question.episode, step) {
        (1, 4..) => [[sign; 7], [-sign; 7]],
        _ => [question.initial_joints, [0.0; 7]],
    })
}

#[test]
fn actions_beyond_the_limit_of_the_ruleset_are_found() {
    let forge = |ruleset: &str| {
        let forgery = forgery();
        forgery.replace_text("manifest.json", "airhockey-2023.3", ruleset);
        forgery.replace_text("results.json", "airhockey-2023.3", ruleset);
        forgery.change_table("steps.parquet", |batch| {
            let mut columns = batch.columns().to_vec();
            let index = batch.schema().index_of("action").unwrap();
            let actions: &ListArray = batch["action"].as_list();
            let mut changed =
                ListBuilder::new(Float64Builder::new()).with_field(match actions.data_type() {
                    DataType::List(field) => field.clone(),
                    other => panic!("{other}"),
                });
            for row in 0..batch.num_rows() {
                let values = actions.value(row);
                let values: &Float64Array = values.as_primitive();
                for (index, value) in values.values().iter().enumerate() {
                    // One number of the last step of the table: no later row depends on it.
                    let is_changed = row + 1 == batch.num_rows() && index == 9;
                    changed
                        .values()
                        .append_value(if is_changed { 2e4 } else { *value });
                }
                changed.append(true);
            }
            columns[index] = Arc::new(changed.finish());
            RecordBatch::try_new(batch.schema(), columns).unwrap()
        });
        difference(forgery.update_manifest().dir.path(), 2)
    };
    for bounded in ["airhockey-2023.2", "airhockey-2023.3"] {
        let found = forge(bounded);
        assert_eq!((&*found.field, &*found.recorded), ("action", "20000.0"));
        assert_eq!(found.expected, "14 numbers of at most 10000 in magnitude");
    }
    // The first ruleset only required finite numbers; there the resulting state differs.
    let found = forge("airhockey-2023.1");
    assert_ne!(found.field, "action");
}

#[test]
fn datasets_with_extreme_commands_verify() {
    let evaluation = Evaluation::play(Some(command_extremes), &[(PREPARE, 0..3)]).assembled();
    let verified = check(&evaluation.archive(), 2).unwrap();
    assert_eq!(verified.episodes, 3);
}

#[test]
fn invented_divergence_is_found() {
    let faults_in_step_3: Agent =
        |question| (question.step != Some(3)).then_some([question.initial_joints, [0.0; 7]]);
    let evaluation = Evaluation::play(Some(faults_in_step_3), &[(PREPARE, 0..2)]).assembled();
    check(&evaluation.archive(), 2).unwrap();
    let forgery = Forgery::copy_of(&evaluation.folder());
    forgery.change_table("episodes.parquet", |batch| {
        let mut columns = batch.columns().to_vec();
        let index = batch.schema().index_of("fault").unwrap();
        let faults: &StringArray = batch["fault"].as_string();
        let diverged = r#""kind":"diverged","detail":"x""#;
        let forged = |fault: Option<&str>| {
            fault.map(|fault| fault.replace(r#""kind":"non_finite""#, diverged))
        };
        let forged: StringArray = faults.iter().map(forged).collect();
        columns[index] = Arc::new(forged);
        RecordBatch::try_new(batch.schema(), columns).unwrap()
    });
    let found = difference(forgery.update_manifest().dir.path(), 2);
    assert_eq!(
        (&*found.field, found.episode),
        ("fault", Some(0)),
        "{found}"
    );
    assert!(found.recorded.contains("diverge"), "{found}");
}

#[test]
fn steps_of_an_agent_that_had_not_started_are_found() {
    let faults_in_step_3: Agent =
        |question| (question.step != Some(3)).then_some([question.initial_joints, [0.0; 7]]);
    let evaluation = Evaluation::play(Some(faults_in_step_3), &[(PREPARE, 0..2)]).assembled();
    let forgery = Forgery::copy_of(&evaluation.folder());
    forgery.change_table("episodes.parquet", |batch| {
        let mut columns = batch.columns().to_vec();
        let index = |name: &str| batch.schema().index_of(name).unwrap();
        let faults: &StringArray = batch["fault"].as_string();
        let at_start = |fault: Option<&str>| {
            let mut fault: serde_json::Value = serde_json::from_str(fault.unwrap()).unwrap();
            fault["episode"].take();
            fault["step"].take();
            Some(fault.to_string())
        };
        let forged: StringArray = faults.iter().map(at_start).collect();
        columns[index("fault")] = Arc::new(forged);
        let rows = batch.num_rows();
        columns[index("interpolation")] = Arc::new(StringArray::new_null(rows));
        RecordBatch::try_new(batch.schema(), columns).unwrap()
    });
    let found = difference(forgery.update_manifest().dir.path(), 2);
    assert_eq!((&*found.field, found.step), ("step", Some(0)), "{found}");
    assert!(found.expected.contains("had not started"), "{found}");
}

#[test]
fn oversized_files_are_refused_before_they_are_parsed() {
    let open = |forgery: &Forgery| Dataset::open(forgery.dir.path(), simulator().competition());
    let append_spaces = |forgery: &Forgery, name: &str, bytes: usize| {
        let mut text = fs::read(forgery.path(name)).unwrap();
        text.resize(text.len() + bytes, b' ');
        fs::write(forgery.path(name), text).unwrap();
    };
    let forged = forgery();
    append_spaces(&forged, "manifest.json", 1 << 20);
    let error = open(&forged).unwrap_err().to_string();
    assert!(error.contains("manifest.json is larger than"), "{error}");

    let forged = forgery();
    append_spaces(&forged, "results.json", 16 << 20);
    let forged = forged.update_manifest();
    let dataset = open(&forged).unwrap();
    let error = dataset.results().unwrap_err().to_string();
    assert!(error.contains("results.json is larger than"), "{error}");

    let forged = forgery();
    append_spaces(&forged, "violations.json", 1 << 20);
    let forged = forged.update_manifest();
    let difference = difference(forged.dir.path(), 1);
    assert_eq!(difference.file, "violations.json");
    assert!(difference.field.starts_with("byte "), "{difference}");

    let forged = forgery();
    forged.replace_text("manifest.json", "\"hit\": 2", "\"hit\": 100001");
    let error = open(&forged).unwrap_err().to_string();
    assert!(error.contains("at most 100000 are possible"), "{error}");
}

#[test]
fn tables_with_more_rows_than_episodes_are_not_read() {
    let forged = forgery();
    forged.change_table("episodes.parquet", |episodes| concat(&vec![episodes; 1000]));
    let forged = forged.update_manifest();
    let error = check(forged.dir.path(), 1).unwrap_err().to_string();
    assert!(
        error.contains("episodes.parquet has 4000 rows, expected 4"),
        "{error}"
    );
}

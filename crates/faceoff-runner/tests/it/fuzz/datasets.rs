//! Fuzz test of datasets: each is read, or refused as differing, altered, unreadable or foreign (of another version).

use super::{assert_outcomes, fuzz, mutation::mutate, rng::Rng};
use faceoff_airhockey::{DEFEND, EVALUATION, HIT, simulator};
use faceoff_dataset::{
    Dataset, DatasetError, Recorder, ShardFolder, ShardReport, assemble, shard_conditions,
    verify::{VerifyError, verify},
};
use faceoff_episode::{AnswerTiming, RunningEpisode, Simulator, StepSink};
use faceoff_sim::Interpolation;
use faceoff_types::{Phase, Seed};
use faceoff_wire::job::{EvaluationMeta, ShardSpec};
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    fs::{self, File},
    num::NonZero,
    path::Path,
};
use tempfile::TempDir;
use zip::ZipArchive;

/// Texts that mutations insert.
const WORDS: [&str; 16] = [
    "null",
    "-1",
    "1e999",
    "4294967296",
    "\"\"",
    "{}",
    "[]",
    "faceoff-dataset/2",
    "faceoff-dataset/1",
    "airhockey-2023.1",
    "airhockey-1999",
    "PAR1",
    "hit",
    "prepare",
    "00",
    "\u{202e}",
];

/// Records a dataset of two short episodes.
fn record_dataset(dir: &Path) {
    let seed = Seed::from_number(5);
    let spec = ShardSpec {
        ruleset: faceoff_airhockey::RULESET,
        platform_retries: 0,
        task: DEFEND,
        episodes: 0..2,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        max_faults: 9,
        perturbations: Default::default(),
    };
    let shard = dir.join("shard");
    let folder = ShardFolder::create(&shard).unwrap();
    let mut recorder = Recorder::create(&folder, spec.task, simulator().competition()).unwrap();
    let world_factory = simulator().world_factory(&shard_conditions(&spec)).unwrap();
    let world_factory = world_factory.as_ref();
    let mut outcomes = Vec::new();
    for episode in spec.episodes.clone() {
        let layout = Some(Interpolation::Linear.into());
        let mut running =
            RunningEpisode::begin(world_factory, spec.task, episode, layout, &mut recorder)
                .unwrap();
        let outcome = loop {
            let request = running.action_request().unwrap();
            if request.step == 30 {
                let line = Some("oops".to_owned());
                let fault = faceoff_types::AgentFaultKind::NonFinite;
                break running.outcome_after_fault(Phase::Step, fault, line);
            }
            let action = request.observation[6..13].to_vec();
            let timing = AnswerTiming {
                computation_time_s: 0.001,
                host_time_s: 0.0,
                cpu_time_s: None,
            };
            if let Some(outcome) = running.answer(&action, timing).unwrap() {
                break outcome;
            }
        };
        recorder.end(&outcome, 0).unwrap();
        outcomes.push(outcome);
    }
    recorder.finish().unwrap();
    let report = ShardReport {
        outcomes,
        log: "goodbye\n".to_owned(),
        stopped_by_faults: false,
        timing: Default::default(),
    };
    folder.commit(&spec, &report, simulator().as_ref()).unwrap();
    let meta = EvaluationMeta {
        profile: spec.profile,
        seed: spec.seed,
        mismatch_seed: spec.mismatch_seed,
        agent: "test".into(),
        ruleset: spec.ruleset,
        variation: Default::default(),
        task_weights: faceoff_airhockey::competition().weights(&Default::default()),
        tiers: faceoff_airhockey::competition().tiers,
    };
    assemble(
        &meta,
        &[shard],
        &dir.join("dataset.zip"),
        None,
        simulator().as_ref(),
    )
    .unwrap();
}

/// A dataset or a game's recording: its files by name, and its archive.
pub(super) struct ValidRecording {
    files: BTreeMap<String, Vec<u8>>,
    archive: Vec<u8>,
}

impl ValidRecording {
    pub(super) fn read(archive: &Path, scratch: &Path) -> Self {
        let folder = scratch.join("unpacked");
        ZipArchive::new(File::open(archive).unwrap())
            .unwrap()
            .extract(&folder)
            .unwrap();
        let files = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| {
                let entry = entry.unwrap();
                let name = entry.file_name().into_string().unwrap();
                (name, fs::read(entry.path()).unwrap())
            })
            .collect();
        fs::remove_dir_all(&folder).unwrap();
        Self {
            files,
            archive: fs::read(archive).unwrap(),
        }
    }

    /// Writes a mutation and returns the path to open.
    pub(super) fn write_mutated(&self, dir: &Path, rng: &mut Rng) -> std::path::PathBuf {
        if rng.once_in(3) {
            let mut archive = self.archive.clone();
            mutate(&mut archive, &WORDS, rng);
            let path = dir.join("dataset.zip");
            fs::write(&path, archive).unwrap();
            return path;
        }
        let mut files = self.files.clone();
        let names: Vec<_> = files.keys().cloned().collect();
        let name = rng.pick(&names);
        match rng.below(10) {
            0 => drop(files.remove(name)),
            1 => drop(files.insert("extra".to_owned(), Vec::new())),
            _ => mutate(files.get_mut(name).unwrap(), &WORDS, rng),
        }
        // Usually the hashes are updated, as an attacker would do.
        let manifest = files.get("manifest.json").map(Vec::as_slice);
        let manifest = manifest.map(serde_json::from_slice::<Value>);
        if let Some(Ok(mut manifest)) = manifest
            && !rng.once_in(4)
        {
            let listed = manifest.get_mut("files").and_then(Value::as_object_mut);
            for (name, digest) in listed.into_iter().flatten() {
                if let Some(bytes) = files.get(name) {
                    *digest = json!({
                        "bytes": bytes.len(),
                        "blake3": blake3::hash(bytes).to_hex().to_string(),
                    });
                }
            }
            let bytes = serde_json::to_vec(&manifest).unwrap();
            files.insert("manifest.json".to_owned(), bytes);
        }
        for (name, bytes) in &files {
            fs::write(dir.join(name), bytes).unwrap();
        }
        dir.to_owned()
    }
}

/// The label of a recording's outcome.
pub(super) fn label(outcome: &Result<(), VerifyError>) -> &'static str {
    match outcome {
        Ok(()) => "read",
        Err(VerifyError::Differs(_)) => "differs",
        Err(VerifyError::Dataset(DatasetError::Io(_))) => "io",
        Err(VerifyError::Dataset(DatasetError::Unreadable(_))) => "unreadable",
        Err(VerifyError::Dataset(DatasetError::Foreign(_))) => "foreign",
        Err(VerifyError::Dataset(DatasetError::Altered(_))) => "altered",
        Err(VerifyError::Dataset(DatasetError::Absent(_))) => "absent",
        Err(VerifyError::Threads(error)) => panic!("{error}"),
        Err(VerifyError::Recording(error)) => panic!("{error}"),
        Err(VerifyError::Job(error)) => panic!("{error}"),
    }
}

/// Reads the whole dataset, and stops at the first error.
fn read(path: &Path, rng: &mut Rng) -> Result<(), VerifyError> {
    let dataset = if rng.once_in(2) {
        Dataset::open(path, simulator().competition())?
    } else {
        Dataset::open_lazily(path, simulator().competition())?
    };
    dataset.results()?;
    dataset.calibration()?;
    dataset.episodes()?;
    let episode = *rng.pick(&[0, 1, 7]);
    dataset.episode(*rng.pick(&[DEFEND, HIT]), episode, None)?;
    verify(
        &dataset,
        simulator().as_ref(),
        NonZero::<usize>::MIN,
        &|| (),
    )
    .map(drop)
}

#[test]
fn dataset_is_read_or_refused() {
    let scratch = TempDir::new().unwrap();
    record_dataset(scratch.path());
    let fixture = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/fixtures/dataset-layout-2.zip"
    );
    let valid = [
        ValidRecording::read(&scratch.path().join("dataset.zip"), scratch.path()),
        ValidRecording::read(Path::new(fixture), scratch.path()),
    ];
    let outcomes = fuzz("datasets", 1500, |rng| {
        let dir = scratch.path().join("changed");
        fs::create_dir(&dir).unwrap();
        // The larger dataset is simulated only occasionally.
        let valid = &valid[usize::from(rng.once_in(20))];
        let path = valid.write_mutated(&dir, rng);
        let label = label(&read(&path, rng));
        fs::remove_dir_all(&dir).unwrap();
        label.to_owned()
    });
    let kinds = [
        "io",
        "read",
        "differs",
        "unreadable",
        "foreign",
        "altered",
        "absent",
    ];
    assert_outcomes(&outcomes, &kinds);
}

//! Joins the shards of an evaluation to its dataset, and scores it.

use crate::{
    PlatformFault,
    recording::{
        CALIBRATION_FILE, EPISODES_FILE, HashingWriter, LOG_FILE, MANIFEST_FILE, RESULTS_FILE,
        STEPS_FILE, ShardRecording, StepScan, VIOLATIONS_FILE, join, scan_steps,
    },
    seal,
    simulator::simulator_id,
};
use faceoff_types::{
    ComputationTime, EpisodeEnd, EpisodeOutcome, EvaluationResult, Profile, Seed, SlotTiming, Task,
    TaskResult,
};
use faceoff_wire::dataset::{
    CalibrationFile, DATASET_SCHEMA, DatasetManifest, FileDigest, ShardCalibration, SlowEpisode,
    TaskViolations, ViolationsFile,
};
use faceoff_wire::work::EvaluationMeta;
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

/// Joins the recordings of all shards of an evaluation, in any order, into one zip archive:
/// `steps.parquet`, `episodes.parquet`, `violations.json`, `results.json`, `calibration.json`,
/// `agent.log` and `manifest.json` with the hashes of the others. Returns the score, which is also `results.json`.
///
/// Nothing is simulated again. The archive is written under a temporary name and renamed; the same
/// shards give the same bytes.
///
/// # Errors
/// [`PlatformFault::Recording`] when a shard is damaged, incomplete, of another evaluation, ended
/// by faults, or when episodes are missing or recorded twice; [`PlatformFault::Io`].
pub fn assemble(
    meta: &EvaluationMeta,
    shard_dirs: &[PathBuf],
    archive: &Path,
) -> Result<EvaluationResult, PlatformFault> {
    let mut shards = shard_dirs
        .iter()
        .map(|dir| ShardRecording::open(dir))
        .collect::<Result<Vec<_>, _>>()?;
    shards.sort_by_key(|shard| (shard.spec.task, shard.spec.episodes.start));
    let episodes = check(meta, &shards)?;
    let calibration = calibration(&shards);
    let Scored { result, violations } = score(
        meta.profile,
        meta.seed,
        played(&shards)?,
        calibration.worst(),
    );

    let partial = archive.with_extension("zip.partial");
    write_dataset(
        meta,
        &shards,
        episodes,
        &result,
        &violations,
        &calibration,
        &partial,
    )
    .and_then(|()| {
        fs::rename(&partial, archive).map_err(PlatformFault::io(format!(
            "renaming to {}",
            archive.display()
        )))
    })
    .inspect_err(|_| {
        if let Err(error) = fs::remove_file(&partial) {
            tracing::debug!(%error, "no unfinished dataset to remove");
        }
    })?;
    Ok(result)
}

fn write_dataset(
    meta: &EvaluationMeta,
    shards: &[ShardRecording],
    episodes: BTreeMap<Task, u32>,
    result: &EvaluationResult,
    violations: &ViolationsFile,
    calibration: &CalibrationFile,
    path: &Path,
) -> Result<(), PlatformFault> {
    let file =
        File::create(path).map_err(PlatformFault::io(format!("creating {}", path.display())))?;
    let mut dataset = Dataset::new(file);
    let paths = |path: fn(&ShardRecording) -> &PathBuf| -> Vec<PathBuf> {
        shards.iter().map(|shard| path(shard).clone()).collect()
    };
    dataset.add(STEPS_FILE, |out| join(&paths(|shard| &shard.steps), out))?;
    dataset.add(EPISODES_FILE, |out| {
        join(&paths(|shard| &shard.episodes), out)
    })?;
    dataset.add_json(VIOLATIONS_FILE, violations)?;
    dataset.add_json(RESULTS_FILE, result)?;
    dataset.add_json(CALIBRATION_FILE, calibration)?;
    dataset.add(LOG_FILE, |out| write_log(shards, out))?;
    let manifest = DatasetManifest {
        schema: DATASET_SCHEMA.to_owned(),
        ruleset: meta.ruleset.clone(),
        simulator: simulator_id().clone(),
        profile: meta.profile,
        seed: meta.seed,
        mismatch_seed: meta.mismatch_seed,
        agent: meta.agent.clone(),
        episodes,
        files: dataset.files.clone(),
    };
    dataset.add_json(MANIFEST_FILE, &manifest)?;
    dataset.finish()?;
    seal::put(path)
}

/// All shards belong to this evaluation and together hold each episode of each task once, from 0
/// on. Returns the number of episodes per task.
fn check(
    meta: &EvaluationMeta,
    shards: &[ShardRecording],
) -> Result<BTreeMap<Task, u32>, PlatformFault> {
    let wrong = |what: String| Err(PlatformFault::Recording(what));
    if meta.ruleset != faceoff_types::RULESET {
        return wrong(format!(
            "the evaluation was played by {}, this version scores {}",
            meta.ruleset,
            faceoff_types::RULESET
        ));
    }
    let mut episodes = BTreeMap::new();
    for ShardRecording { spec, report, .. } in shards {
        let name = format!(
            "{} {}..{}",
            spec.task, spec.episodes.start, spec.episodes.end
        );
        if (spec.profile, spec.seed, spec.mismatch_seed)
            != (meta.profile, meta.seed, meta.mismatch_seed)
        {
            return wrong(format!("shard {name} belongs to another evaluation"));
        }
        if report.stopped_by_faults {
            return wrong(format!(
                "shard {name} was ended by the agent's faults: there is no score"
            ));
        }
        let next = episodes.entry(spec.task).or_insert(0);
        if spec.episodes.start != *next {
            return wrong(format!(
                "shard {name} does not follow on episode {next}: episodes are missing or twice"
            ));
        }
        let expected = spec.episodes.clone().map(|episode| (spec.task, episode));
        if !expected.eq(report
            .outcomes
            .iter()
            .map(|outcome| (outcome.task, outcome.episode)))
        {
            return wrong(format!("shard {name} does not report its episodes"));
        }
        *next = spec.episodes.end;
    }
    if episodes.is_empty() {
        return wrong("an evaluation without shards".to_owned());
    }
    Ok(episodes)
}

/// What each slot measured of itself.
fn calibration(shards: &[ShardRecording]) -> CalibrationFile {
    CalibrationFile {
        schema: DATASET_SCHEMA.to_owned(),
        shards: shards
            .iter()
            .map(|ShardRecording { spec, report, .. }| ShardCalibration {
                task: spec.task,
                first_episode: spec.episodes.start,
                end_episode: spec.episodes.end,
                timing: report.timing,
            })
            .collect(),
    }
}

/// What follows from the episodes of an evaluation.
pub(crate) struct Scored {
    pub result: EvaluationResult,
    pub violations: ViolationsFile,
}

/// Scores from outcomes and steps, per task in order of the episodes.
pub(crate) fn score(
    profile: Profile,
    seed: Seed,
    played: BTreeMap<Task, (Vec<EpisodeOutcome>, StepScan)>,
    timing: Option<SlotTiming>,
) -> Scored {
    let mut tasks: BTreeMap<Task, TaskResult> = BTreeMap::new();
    let mut violations = ViolationsFile {
        schema: DATASET_SCHEMA.to_owned(),
        tasks: BTreeMap::new(),
    };
    for (task, (outcomes, mut scan)) in played {
        tasks.insert(
            task,
            faceoff_scoring::score_task(&outcomes, &mut scan.computation_times_s),
        );
        let [joint_pos, joint_vel, ee, link] = scan.violations;
        let computation_time = outcomes.iter().filter_map(slow_episode).collect();
        violations.tasks.insert(
            task,
            TaskViolations {
                ee,
                link,
                joint_pos,
                joint_vel,
                computation_time,
            },
        );
    }
    let mut result = faceoff_scoring::score_evaluation(profile, seed, tasks);
    result.timing = timing;
    Scored { result, violations }
}

/// Outcomes and steps of all shards, which come in order.
fn played(
    shards: &[ShardRecording],
) -> Result<BTreeMap<Task, (Vec<EpisodeOutcome>, StepScan)>, PlatformFault> {
    let mut played: BTreeMap<Task, (Vec<EpisodeOutcome>, StepScan)> = BTreeMap::new();
    for shard in shards {
        let (outcomes, scan) = played.entry(shard.spec.task).or_default();
        outcomes.extend_from_slice(&shard.report.outcomes);
        scan_steps(&shard.steps, scan)?;
    }
    for (task, (outcomes, scan)) in &played {
        let steps: usize = outcomes.iter().map(|outcome| outcome.steps as usize).sum();
        if scan.computation_times_s.len() != steps {
            return Err(PlatformFault::Recording(format!(
                "{task}: {} steps are recorded, {steps} were played",
                scan.computation_times_s.len()
            )));
        }
    }
    Ok(played)
}

/// A JSON file of a dataset, byte for byte.
pub(crate) fn json_file<T: Serialize>(name: &str, value: &T) -> Result<Vec<u8>, PlatformFault> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(PlatformFault::recording(format!("writing {name}")))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The archive being written.
struct Dataset {
    zip: ZipWriter<BufWriter<File>>,
    files: BTreeMap<String, FileDigest>,
}

impl Dataset {
    fn new(file: File) -> Self {
        Self {
            zip: ZipWriter::new(BufWriter::with_capacity(128 << 10, file)),
            files: BTreeMap::new(),
        }
    }

    fn add(
        &mut self,
        name: &str,
        write: impl FnOnce(
            &mut HashingWriter<&mut ZipWriter<BufWriter<File>>>,
        ) -> Result<(), PlatformFault>,
    ) -> Result<(), PlatformFault> {
        // Parquet is compressed already. No time is stored: the same shards give the same bytes.
        let method = if name.ends_with(".parquet") {
            CompressionMethod::Stored
        } else {
            CompressionMethod::Deflated
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .large_file(true);
        self.zip
            .start_file(name, options)
            .map_err(PlatformFault::recording(format!(
                "adding {name} to the dataset"
            )))?;
        let mut out = HashingWriter::new(&mut self.zip);
        write(&mut out)?;
        self.files.insert(name.to_owned(), out.digest());
        Ok(())
    }

    fn add_json<T: Serialize>(&mut self, name: &str, value: &T) -> Result<(), PlatformFault> {
        let bytes = json_file(name, value)?;
        self.add(name, |out| {
            out.write_all(&bytes)
                .map_err(PlatformFault::io(format!("writing {name}")))
        })
    }

    fn finish(mut self) -> Result<(), PlatformFault> {
        self.zip
            .set_comment(seal::blank())
            .map_err(PlatformFault::recording("closing the dataset"))?;
        let mut buffered = self
            .zip
            .finish()
            .map_err(PlatformFault::recording("closing the dataset"))?;
        buffered
            .flush()
            .and_then(|()| buffered.get_ref().sync_all())
            .map_err(PlatformFault::io("writing the dataset"))
    }
}

fn write_log(shards: &[ShardRecording], out: &mut dyn Write) -> Result<(), PlatformFault> {
    for ShardRecording { spec, report, .. } in shards {
        let last = spec.episodes.end.saturating_sub(1);
        writeln!(
            out,
            "== {}, episodes {} to {last} ==",
            spec.task, spec.episodes.start
        )
        .and_then(|()| out.write_all(report.log.as_bytes()))
        .map_err(PlatformFault::io("writing the agent's log"))?;
    }
    Ok(())
}

/// The episode as `violations.json` lists it, if it has penalty points for computation time.
fn slow_episode(outcome: &EpisodeOutcome) -> Option<SlowEpisode> {
    // The rule lives in the scoring crate: the points are what an instant agent would not have.
    let instant = EpisodeOutcome {
        computation_time: ComputationTime::default(),
        end: EpisodeEnd::Horizon,
        fault: None,
        ..outcome.clone()
    };
    let points =
        faceoff_scoring::episode_penalty(outcome) - faceoff_scoring::episode_penalty(&instant);
    let ComputationTime { mean_s, max_s } = outcome.computation_time;
    (points > 0.0).then_some(SlowEpisode {
        episode: outcome.episode,
        mean_s,
        max_s,
        points,
    })
}

//! Joins the shards of an evaluation into its dataset, and scores it. A *shard* is the recording of a range of episodes of
//! one task, played in one *slot* (a place of a worker in which one job runs at a time).

use crate::{
    archive_writer::ArchiveWriter,
    dataset::Layout,
    digest,
    error::RecordingError,
    files::{
        CALIBRATION_FILE, EPISODES_FILE, LOG_FILE, MANIFEST_FILE, RESULTS_FILE, STEPS_FILE,
        VIOLATIONS_FILE,
    },
    score::{ScoreRules, ScoredEvaluation, Tally, score},
    shard_folder::ShardRecording,
    simulator::simulator_id,
    table::{ShardTable, join},
};
use faceoff_episode::Simulator;
use faceoff_types::{Competition, EvaluationResult, Task, TaskMap};
use faceoff_wire::{
    dataset::{
        CalibrationFile, DATASET_SCHEMA, DatasetManifest, FileDigest, ShardCalibration, SimulatorId,
    },
    job::EvaluationMeta,
};
use fs_err as fs;
use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

/// The result of assembling a dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct AssembledDataset {
    /// The score; identical to the dataset's `results.json`.
    pub result: EvaluationResult,
    /// Size and hash of the archive. Once published, they authenticate every byte of it.
    pub archive: FileDigest,
    /// Was a pack of clips written? A clip is a compact recording of one episode, for replays in the browser.
    pub has_clips: bool,
}

/// Joins the recordings of all shards of an evaluation, in any order, into one zip archive:
/// `steps.parquet`, `episodes.parquet`, `violations.json`, `results.json`, `calibration.json`,
/// `agent.log` and `manifest.json` with the hashes of the others. The clips for replays are written to a separate
/// pack, `clips`, if given; shards of earlier layouts have no clips.
///
/// No episode is simulated. The archive is written under a temporary name and then renamed. The same shards give the same
/// bytes. Memory grows with the number of episodes, not of their steps.
///
/// # Errors
/// [`RecordingError::Unusable`] if a shard is damaged, incomplete, of another evaluation or ended by faults, or if
/// episodes are missing or recorded twice; [`RecordingError::Io`].
pub fn assemble(
    meta: &EvaluationMeta,
    shard_dirs: &[PathBuf],
    archive: &Path,
    clips: Option<&Path>,
    simulator: &dyn Simulator,
) -> Result<AssembledDataset, RecordingError> {
    let mut shards = shard_dirs
        .iter()
        .map(|dir| ShardRecording::open(dir, simulator))
        .collect::<Result<Vec<_>, _>>()?;
    let task_position = |task: Task| meta.task_weights.tasks().position(|other| other == task);
    shards.sort_by_key(|shard| (task_position(shard.spec.task), shard.spec.episodes.start));
    let episodes = check_shards(meta, &shards)?;
    let calibration = calibration(&shards);
    let competition = simulator.competition();
    let rules = ScoreRules {
        competition,
        ruleset: meta.ruleset,
        profile: meta.profile,
        variation: &meta.variation,
        weights: &meta.task_weights,
        bounds: meta.tier_bounds(),
        seed: meta.seed,
        layout: Layout::Four,
    };
    let scored = score(
        &rules,
        tally_tasks(&shards, competition)?,
        calibration.worst(),
    );

    let partial = archive.with_extension("zip.partial");
    let written = write_archive(
        meta,
        &shards,
        episodes,
        &scored,
        &calibration,
        simulator_id(simulator),
        &partial,
    )
    .and_then(|()| Ok(digest::of_file(&partial)?))
    .and_then(|digest| {
        fs::rename(&partial, archive)?;
        Ok(digest)
    });
    match written {
        Ok(archive) => Ok(AssembledDataset {
            result: scored.result,
            archive,
            has_clips: match clips {
                Some(path) => join_clips(&shards, path)?,
                None => false,
            },
        }),
        Err(error) => {
            if let Err(error) = fs::remove_file(&partial) {
                tracing::debug!(%error, "no unfinished dataset to remove");
            }
            Err(error)
        }
    }
}

/// Joins the shards' clips; returns `false` if there are none.
fn join_clips(shards: &[ShardRecording], path: &Path) -> Result<bool, RecordingError> {
    let packs: Vec<PathBuf> = shards
        .iter()
        .filter_map(|shard| shard.clips.clone())
        .collect();
    if packs.is_empty() {
        return Ok(false);
    }
    let out = faceoff_replay::join_packs(&packs, BufWriter::new(fs::File::create(path)?))?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    Ok(true)
}

/// Writes the archive to `path`; temporary files are in the same folder.
fn write_archive(
    meta: &EvaluationMeta,
    shards: &[ShardRecording],
    episodes: TaskMap<u32>,
    ScoredEvaluation { result, violations }: &ScoredEvaluation,
    calibration: &CalibrationFile,
    simulator: SimulatorId,
    path: &Path,
) -> Result<(), RecordingError> {
    let temporary_dir = match path.parent() {
        Some(dir) if dir != Path::new("") => dir,
        _ => Path::new("."),
    };
    let tables = |table: fn(&ShardRecording) -> &ShardTable| -> Vec<ShardTable> {
        shards.iter().map(|shard| table(shard).clone()).collect()
    };
    let mut dataset = ArchiveWriter::create(path)?;
    dataset.add(STEPS_FILE, |out| {
        join(&tables(|shard| &shard.steps), temporary_dir, out)
    })?;
    dataset.add(EPISODES_FILE, |out| {
        join(&tables(|shard| &shard.episodes), temporary_dir, out)
    })?;
    dataset.add_json(VIOLATIONS_FILE, violations)?;
    dataset.add_json(RESULTS_FILE, result)?;
    dataset.add_json(CALIBRATION_FILE, calibration)?;
    dataset.add(LOG_FILE, |out| write_log(shards, out))?;
    let manifest = DatasetManifest {
        schema: DATASET_SCHEMA.to_owned(),
        ruleset: meta.ruleset.to_string(),
        simulator,
        profile: meta.profile,
        variation: meta.variation.clone(),
        seed: meta.seed,
        mismatch_seed: meta.mismatch_seed,
        agent: meta.agent.clone(),
        episodes,
        files: dataset.files().clone(),
    };
    dataset.add_json(MANIFEST_FILE, &manifest)?;
    dataset.finish()
}

/// Checks that all shards belong to this evaluation and together hold each episode of each task once, from 0 on.
/// Returns the number of episodes per task.
fn check_shards(
    meta: &EvaluationMeta,
    shards: &[ShardRecording],
) -> Result<TaskMap<u32>, RecordingError> {
    let unusable = |problem: String| Err(RecordingError::Unusable(problem));
    let mut episodes = TaskMap::new();
    for ShardRecording { spec, report, .. } in shards {
        let name = format!(
            "{} {}..{}",
            spec.task, spec.episodes.start, spec.episodes.end
        );
        if (spec.profile, spec.seed, spec.mismatch_seed)
            != (meta.profile, meta.seed, meta.mismatch_seed)
        {
            return unusable(format!("shard {name} belongs to another evaluation"));
        }
        if spec.ruleset != meta.ruleset {
            return unusable(format!(
                "shard {name} was played by {}, the evaluation by {}",
                spec.ruleset, meta.ruleset
            ));
        }
        if spec.perturbations != meta.variation.perturbations {
            return unusable(format!(
                "shard {name} was played with other magnitudes of the perturbations than the evaluation"
            ));
        }
        if report.stopped_by_faults {
            return unusable(format!(
                "shard {name} was ended by the agent's faults: there is no score"
            ));
        }
        let next = episodes.entry(spec.task).or_insert(0);
        if spec.episodes.start != *next {
            return unusable(format!(
                "shard {name} does not start at episode {next}: episodes are missing or recorded twice"
            ));
        }
        let expected = spec.episodes.clone().map(|episode| (spec.task, episode));
        if !expected.eq(report
            .outcomes
            .iter()
            .map(|outcome| (outcome.task, outcome.episode)))
        {
            return unusable(format!("shard {name} does not report its episodes"));
        }
        *next = spec.episodes.end;
    }
    if episodes.is_empty() {
        return unusable("an evaluation without shards".to_owned());
    }
    Ok(episodes)
}

/// The timing measurements of each slot, for the dataset's file `calibration.json`.
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

/// The numbers for the score of each task, from the outcomes and steps of all shards, which are in order.
fn tally_tasks(
    shards: &[ShardRecording],
    competition: &Arc<Competition>,
) -> Result<TaskMap<Tally>, RecordingError> {
    let mut steps: TaskMap<u64> = TaskMap::new();
    for ShardRecording { spec, report, .. } in shards {
        let outcomes = report.outcomes.iter();
        *steps.entry(spec.task).or_default() += outcomes
            .map(|outcome| u64::from(outcome.steps))
            .sum::<u64>();
    }
    let mut tallies: TaskMap<Tally> = steps
        .iter()
        .map(|(task, steps)| (*task, Tally::new(*steps, Layout::Four, competition)))
        .collect();
    for shard in shards {
        if let Some(tally) = tallies.get_mut(&shard.spec.task) {
            for outcome in &shard.report.outcomes {
                tally.add_episode(outcome.clone());
            }
            tally.add_table(shard.steps.path(), competition)?;
        }
    }
    for (task, tally) in &tallies {
        if tally.steps() != steps[task] {
            return Err(RecordingError::Unusable(format!(
                "{task}: {} steps are recorded, {} were played",
                tally.steps(),
                steps[task]
            )));
        }
    }
    Ok(tallies)
}

/// Writes the agents' logs of all shards, each under a heading with its episodes.
fn write_log(shards: &[ShardRecording], out: &mut dyn Write) -> Result<(), RecordingError> {
    for ShardRecording { spec, report, .. } in shards {
        let last = spec.episodes.end.saturating_sub(1);
        let (task, first) = (spec.task, spec.episodes.start);
        writeln!(out, "== {task}, episodes {first} to {last} ==")?;
        out.write_all(report.log.as_bytes())?;
    }
    Ok(())
}

//! Runs and scores all episodes of one *profile*, a set of perturbations, and assembles their recordings into a dataset.

use super::{
    files::{LOG, RESULTS, remove_earlier, write_json},
    logs::Logs,
    pool::{EvalOutcome, Job, run_shards},
};
use crate::{
    commands::{side_notes::Notes, silent_agent},
    competition::{competition, simulator},
};
use anyhow::{Context, bail};
use faceoff_dataset::{ARCHIVE_FILE, AssembledDataset, assemble};
use faceoff_runner::{AgentEnvironment, bundle::Bundle};
use faceoff_types::{AgentFault, EpisodeOutcome, EvaluationResult, Profile, Seed, Task, Variation};
use faceoff_wire::job::{EvaluationMeta, ShardSpec};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Settings that all profiles share.
#[derive(Debug)]
pub(super) struct EvalSetup {
    pub bundle: Bundle,
    /// One per worker.
    pub envs: Vec<AgentEnvironment>,
    pub tasks: Vec<Task>,
    pub episodes: u32,
    pub seed: Seed,
    pub mismatch_seed: Seed,
    pub max_faults: u32,
    /// Deviations from the ruleset.
    pub variation: Variation,
    pub notes: Notes,
    /// Folder for unfinished recordings.
    pub scratch: PathBuf,
}

#[derive(Debug)]
pub(super) struct ProfileOutcome {
    pub result: EvaluationResult,
    pub outcomes: Vec<EpisodeOutcome>,
    pub archive_blake3: String,
    pub faults: Vec<AgentFault>,
}

/// Runs all episodes in one profile and writes `results.json` and `dataset.zip` to `out`.
pub(super) fn run_profile(
    setup: &EvalSetup,
    profile: Profile,
    out: &Path,
) -> anyhow::Result<ProfileOutcome> {
    fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
    remove_earlier(out)?;
    let jobs = jobs(setup, profile);
    let dirs: Vec<PathBuf> = jobs.iter().map(|job| job.out.clone()).collect();
    let (outcomes, faults) = match run_shards(&setup.bundle, &setup.envs, jobs, setup.notes)? {
        EvalOutcome::Finished {
            faults,
            outcomes,
            logs,
        } => {
            print_faults(setup.notes, &faults, &logs);
            if !faults.is_empty() {
                let path = write_log(out, &logs)?;
                setup
                    .notes
                    .print(format_args!("the agent's log is in {}", path.display()));
            }
            (outcomes, faults)
        }
        EvalOutcome::NeverAnswered { fault, logs } => {
            let path = write_log(out, &logs)?;
            print_first_output(setup.notes, &fault, &logs);
            bail!(
                "{}\nThe agent's log is in {}",
                silent_agent::stop_reason("the agent", "evaluation", &fault),
                path.display()
            );
        }
        EvalOutcome::Failed { faults, logs } => {
            let path = write_log(out, &logs)?;
            print_faults(setup.notes, &faults, &logs);
            let last = faults.last().map(ToString::to_string).unwrap_or_default();
            bail!(
                "the agent failed: it had more than {} faults, so there is no score; the last fault: \
                {last}; the agent's log is in {}",
                setup.max_faults,
                path.display()
            );
        }
    };
    let meta = EvaluationMeta {
        profile,
        seed: setup.seed,
        mismatch_seed: setup.mismatch_seed,
        agent: setup.bundle.manifest.name.clone(),
        ruleset: competition().ruleset(),
        variation: setup.variation.clone(),
        task_weights: competition().weights(&setup.variation),
        tiers: competition().tiers,
    };
    let AssembledDataset {
        result, archive, ..
    } = assemble(
        &meta,
        &dirs,
        &out.join(ARCHIVE_FILE),
        None,
        simulator().as_ref(),
    )
    .context("joining the recordings")?;
    // The dataset contains the recordings now, and the runs of further profiles need the disk space.
    for dir in &dirs {
        fs::remove_dir_all(dir).with_context(|| format!("removing {}", dir.display()))?;
    }
    write_json(&out.join(RESULTS), &result)?;
    Ok(ProfileOutcome {
        result,
        outcomes,
        archive_blake3: archive.blake3,
        faults,
    })
}

/// Divides the episodes into shards: one per task and worker, so that few agent processes are started.
fn jobs(setup: &EvalSetup, profile: Profile) -> Vec<Job> {
    let workers = u32::try_from(setup.envs.len()).unwrap_or(u32::MAX);
    let per_shard = setup.episodes.div_ceil(workers);
    let mut jobs = Vec::new();
    for task in &setup.tasks {
        for start in (0..setup.episodes).step_by(per_shard as usize) {
            let end = setup.episodes.min(start + per_shard);
            jobs.push(Job {
                out: setup.scratch.join(format!("{profile}-{task}-{start}")),
                spec: ShardSpec {
                    ruleset: competition().ruleset(),
                    platform_retries: 0,
                    task: *task,
                    episodes: start..end,
                    profile,
                    seed: setup.seed,
                    mismatch_seed: setup.mismatch_seed,
                    max_faults: setup.max_faults,
                    perturbations: setup.variation.perturbations.clone(),
                },
            });
        }
    }
    jobs
}

/// Prints how often each repeated fault occurred, since each kind was printed only once, and the agent's output before the first
/// fault.
fn print_faults(notes: Notes, faults: &[AgentFault], logs: &Logs) {
    let mut counts: Vec<(&AgentFault, u32)> = Vec::new();
    for fault in faults {
        match counts
            .iter_mut()
            .find(|(other, _)| other.fault == fault.fault)
        {
            Some((_, count)) => *count += 1,
            None => counts.push((fault, 1)),
        }
    }
    for (fault, count) in counts.iter().filter(|(_, count)| *count > 1) {
        notes.print(format_args!(
            "{count} episodes had this fault: {}",
            fault.fault
        ));
    }
    if let Some(first) = faults.first() {
        print_first_output(notes, first, logs);
    }
}

/// Prints the agent's output before its first fault.
fn print_first_output(notes: Notes, first: &AgentFault, logs: &Logs) {
    const MAX_LINES: usize = 40;
    let lines = logs.lines_before(first);
    if lines.is_empty() {
        notes.print(format_args!(
            "the agent wrote nothing to standard error before its first fault"
        ));
        return;
    }
    notes.print(format_args!("the agent's output before its first fault:"));
    let left_out = lines.len().saturating_sub(MAX_LINES);
    if left_out > 0 {
        notes.print(format_args!("  … {left_out} more lines"));
    }
    for line in &lines[left_out..] {
        notes.print(format_args!("  {line}"));
    }
}

fn write_log(out: &Path, logs: &Logs) -> anyhow::Result<PathBuf> {
    let path = out.join(LOG);
    fs::write(&path, logs.concat()).with_context(|| format!("writing {}", path.display()))?;
    Ok(path)
}

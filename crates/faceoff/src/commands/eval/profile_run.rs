//! All episodes in one profile: played, joined, scored.

use super::{
    files::{LOG, RESULTS, remove_earlier, write_json},
    logs::Logs,
    pool::{Job, Verdict, play_all},
    said::Said,
};
use anyhow::{Context, bail};
use faceoff_dataset::{ARCHIVE_FILE, Assembled, assemble};
use faceoff_runner::{AgentEnvironment, bundle::Bundle};
use faceoff_types::{
    AgentFault, EpisodeOutcome, EvaluationResult, Profile, Ruleset, Seed, Task, Variation,
};
use faceoff_wire::work::{EvaluationMeta, ShardSpec};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// What every profile is played with.
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
    /// What is played and scored by otherwise than the ruleset has it.
    pub variation: Variation,
    pub said: Said,
    /// For recordings under way.
    pub scratch: PathBuf,
}

/// What came of one profile.
#[derive(Debug)]
pub(super) struct Played {
    pub result: EvaluationResult,
    pub outcomes: Vec<EpisodeOutcome>,
    pub archive_blake3: String,
    pub faults: Vec<AgentFault>,
}

/// Plays all episodes in one profile and leaves `results.json` and `dataset.zip` in `out`.
pub(super) fn play(setup: &EvalSetup, profile: Profile, out: &Path) -> anyhow::Result<Played> {
    fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
    remove_earlier(out)?;
    let jobs = jobs(setup, profile);
    let dirs: Vec<PathBuf> = jobs.iter().map(|job| job.out.clone()).collect();
    let (outcomes, faults) = match play_all(&setup.bundle, &setup.envs, jobs)? {
        Verdict::Played {
            faults,
            outcomes,
            logs,
        } => {
            print_faults(setup.said, &faults, &logs);
            if !faults.is_empty() {
                let path = write_log(out, &logs)?;
                setup
                    .said
                    .line(format_args!("the agent's log is in {}", path.display()));
            }
            (outcomes, faults)
        }
        Verdict::Failed { faults, logs } => {
            let path = write_log(out, &logs)?;
            print_faults(setup.said, &faults, &logs);
            let last = faults.last().map(ToString::to_string).unwrap_or_default();
            bail!(
                "the agent failed: more than {} faults, so there is no score; the last one: \
                 {last}; its log is in {}",
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
        ruleset: Ruleset::CURRENT,
        variation: setup.variation.clone(),
    };
    let Assembled {
        result, archive, ..
    } = assemble(&meta, &dirs, &out.join(ARCHIVE_FILE), None).context("joining the recordings")?;
    // They are in the dataset now; a further profile needs the room.
    for dir in &dirs {
        fs::remove_dir_all(dir).with_context(|| format!("removing {}", dir.display()))?;
    }
    write_json(&out.join(RESULTS), &result)?;
    Ok(Played {
        result,
        outcomes,
        archive_blake3: archive.blake3,
        faults,
    })
}

/// One shard per task and worker, so that each agent is started as seldom as possible.
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
                    ruleset: Ruleset::CURRENT,
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

/// All of them, and of the first what the agent wrote before it.
fn print_faults(said: Said, faults: &[AgentFault], logs: &Logs) {
    const LINES: usize = 40;
    for fault in faults {
        said.line(format_args!("fault: {fault}"));
    }
    let Some(first) = faults.first() else {
        return;
    };
    let lines = logs.before(first);
    if lines.is_empty() {
        said.line(format_args!(
            "before the first fault the agent wrote nothing to its standard error"
        ));
        return;
    }
    said.line(format_args!("what the agent wrote before the first fault:"));
    let left_out = lines.len().saturating_sub(LINES);
    if left_out > 0 {
        said.line(format_args!("  … {left_out} lines more"));
    }
    for line in &lines[left_out..] {
        said.line(format_args!("  {line}"));
    }
}

fn write_log(out: &Path, logs: &Logs) -> anyhow::Result<PathBuf> {
    let path = out.join(LOG);
    fs::write(&path, logs.whole()).with_context(|| format!("writing {}", path.display()))?;
    Ok(path)
}

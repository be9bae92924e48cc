//! `faceoff eval`: the server's evaluator, run locally.
#![expect(clippy::print_stdout, reason = "a command talks to the terminal")]

mod ablation;
mod board;
mod table;

use crate::config::Config;
use anyhow::{Context, bail, ensure};
use board::{Job, Verdict, play_all};
use clap::Args;
use faceoff_runner::{
    AgentEnvironment, EvaluationMeta, ShardSpec, assemble,
    bundle::{self, Bundle, BundleError, BundleLimits},
};
use faceoff_sandbox::{Isolation, Runtime};
use faceoff_types::{
    AgentFault, EpisodeOutcome, EvaluationResult, MAX_EPISODES_PER_TASK, Profile, RULESET, Seed,
    Task,
};
use faceoff_worker::CpuLayout;
use rustix::thread::{CpuSet, sched_getaffinity};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Plays a bundle through the very evaluator that the server runs, prints the result and writes
/// `results.json` and `dataset.zip` to a folder. Exit status 0 only if there is a result.
#[derive(Debug, Args)]
pub struct EvalCommand {
    /// The agent: a folder with agent.toml, or a .tar.gz, .tar.zst or .zip
    bundle: PathBuf,
    /// Tasks to play
    #[arg(
        long = "task",
        value_name = "TASKS",
        value_delimiter = ',',
        default_value = "hit,defend,prepare"
    )]
    tasks: Vec<Task>,
    /// Episodes of each task
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_EPISODES_PER_TASK)))]
    episodes: u32,
    /// Perturbations: ideal, one factor's name, or evaluation
    #[arg(long, default_value = "evaluation")]
    profile: Profile,
    /// Play the same episodes in every profile (ideal, each factor alone, all together) and compare
    /// them: ablation.json, and a folder for each profile
    #[arg(long, conflicts_with = "profile")]
    ablation: bool,
    /// A number, or 64 hexadecimal digits; the same seed gives the same episodes everywhere
    #[arg(long, default_value = "0")]
    seed: Seed,
    /// Seed of the season's model mismatch; derived from the seed if left out
    #[arg(long, value_name = "HEX")]
    mismatch_seed: Option<Seed>,
    /// Agents that play at the same time; results do not depend on it, computation times may
    #[arg(long, value_name = "W", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: u16,
    /// Folder for results.json and dataset.zip; those of an earlier run are replaced
    #[arg(long, value_name = "DIR", default_value = "faceoff-eval")]
    out: PathBuf,
    /// Run your own agent without isolation, with your own environment
    #[arg(long)]
    no_sandbox: bool,
    /// Limits, runtimes and given-up layers as a server's configuration states them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

/// What an earlier run may have left in the folder.
const RESULTS: &str = "results.json";
const DATASET: &str = "dataset.zip";
const LOG: &str = "agent.log";

/// What all profiles are played with.
#[derive(Debug)]
struct Ground {
    bundle: Bundle,
    /// One per worker.
    envs: Vec<AgentEnvironment>,
    mismatch_seed: Seed,
    max_faults: u32,
    /// For recordings under way.
    scratch: PathBuf,
}

/// What came of one profile.
#[derive(Debug)]
struct Played {
    result: EvaluationResult,
    outcomes: Vec<EpisodeOutcome>,
}

impl EvalCommand {
    /// Plays, scores, prints and writes.
    ///
    /// # Errors
    /// If the bundle is refused, the agent fails too often, or the platform fails; the error says
    /// which.
    pub fn run(mut self) -> anyhow::Result<()> {
        self.tasks.sort_unstable();
        self.tasks.dedup();
        ensure!(
            !self.tasks.is_empty(),
            "--task: expected hit, defend or prepare"
        );
        let config = Config::load(self.config.as_deref())?;
        fs::create_dir_all(&self.out)
            .with_context(|| format!("creating {}", self.out.display()))?;
        remove_results(&self.out)?;
        // Beside the results, not in /tmp: a recording may be larger than a memory file system. An
        // agent of another user must be able to pass through.
        let scratch = tempfile::Builder::new()
            .prefix(".eval-")
            .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o755))
            .tempdir_in(&self.out)
            .with_context(|| format!("making a folder in {}", self.out.display()))?;
        let bundle = self.open(scratch.path(), &config.bundle)?;
        let envs = self.environments(&config, &bundle.manifest.runtime)?;

        let ground = Ground {
            mismatch_seed: self
                .mismatch_seed
                .unwrap_or_else(|| self.seed.model_mismatch()),
            max_faults: config.evaluation.max_faults,
            scratch: scratch.path().to_owned(),
            bundle,
            envs,
        };
        if self.ablation {
            return ablation::run(&self, &ground);
        }
        let played = self.play(&ground, self.profile, &self.out)?;
        print!(
            "{}",
            table::of(&ground.bundle.manifest.name, &played.result)
        );
        println!(
            "\n{}\n{}",
            self.out.join(RESULTS).display(),
            self.out.join(DATASET).display()
        );
        Ok(())
    }

    /// Plays all episodes in one profile and leaves `results.json` and `dataset.zip` in `out`.
    fn play(&self, ground: &Ground, profile: Profile, out: &Path) -> anyhow::Result<Played> {
        fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
        remove_results(out)?;
        let jobs = self.jobs(ground, profile);
        let dirs: Vec<PathBuf> = jobs.iter().map(|job| job.out.clone()).collect();
        let outcomes = match play_all(&ground.bundle, &ground.envs, jobs)? {
            Verdict::Played { faults, outcomes } => {
                print_faults(&faults);
                outcomes
            }
            Verdict::Failed { faults, log } => {
                let path = out.join(LOG);
                fs::write(&path, &log).with_context(|| format!("writing {}", path.display()))?;
                print_faults(&faults);
                print_log_tail(&log);
                let last = faults.last().map(ToString::to_string).unwrap_or_default();
                bail!(
                    "the agent failed: more than {} faults, so there is no score; the last one: \
                     {last}; its log is in {}",
                    ground.max_faults,
                    path.display()
                );
            }
        };
        let meta = EvaluationMeta {
            profile,
            seed: self.seed,
            mismatch_seed: ground.mismatch_seed,
            agent: ground.bundle.manifest.name.clone(),
            ruleset: RULESET.to_owned(),
        };
        let result =
            assemble(&meta, &dirs, &out.join(DATASET)).context("joining the recordings")?;
        // They are in the dataset now; a further profile needs the room.
        for dir in &dirs {
            fs::remove_dir_all(dir).with_context(|| format!("removing {}", dir.display()))?;
        }
        write_json(&out.join(RESULTS), &result)?;
        Ok(Played { result, outcomes })
    }

    /// A folder is copied under the rules of an archive, so that it is refused here if the server
    /// would refuse it; without a sandbox it is used in place.
    fn open(&self, scratch: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> {
        if self.bundle.is_dir() && !self.no_sandbox {
            bundle::copy(&self.bundle, &scratch.join("bundle"), limits)
        } else {
            bundle::open(&self.bundle, scratch, limits)
        }
    }

    /// One environment per worker: the server's limits, on CPUs of its own where there are enough.
    fn environments(
        &self,
        config: &Config,
        runtime: &str,
    ) -> anyhow::Result<Vec<AgentEnvironment>> {
        let mut env = config.agent_environment();
        if self.no_sandbox {
            env.isolation = Isolation::None;
            // The developer's own machine offers whatever the developer's PATH finds.
            let path = std::env::var("PATH").unwrap_or_default();
            env.runtimes.insert(
                runtime.to_owned(),
                Runtime {
                    read_only_paths: Vec::new(),
                    path,
                },
            );
        }
        let workers = usize::from(self.workers);
        // Those that this process may use: not always the machine's, nor numbered from 0.
        let allowed = sched_getaffinity(None).context("asking for the CPUs of this process")?;
        let cpus: Vec<usize> = (0..CpuSet::MAX_CPU)
            .filter(|cpu| allowed.is_set(*cpu))
            .collect();
        let layout = CpuLayout::divide(&cpus, workers);
        if layout.shared && workers > 1 {
            println!(
                "note: {workers} workers share {} CPUs; results are the same, computation \
                 times may be longer",
                cpus.len()
            );
        }
        Ok(layout
            .slots
            .into_iter()
            .map(|cpus| AgentEnvironment {
                agent_cpus: cpus.agent,
                ..env.clone()
            })
            .collect())
    }

    /// One shard per task and worker, so that each agent is started as seldom as possible.
    fn jobs(&self, ground: &Ground, profile: Profile) -> Vec<Job> {
        let per_shard = self.episodes.div_ceil(u32::from(self.workers));
        let mut jobs = Vec::new();
        for task in &self.tasks {
            for start in (0..self.episodes).step_by(per_shard as usize) {
                let end = self.episodes.min(start + per_shard);
                jobs.push(Job {
                    out: ground.scratch.join(format!("{profile}-{task}-{start}")),
                    spec: ShardSpec {
                        task: *task,
                        episodes: start..end,
                        profile,
                        seed: self.seed,
                        mismatch_seed: ground.mismatch_seed,
                        max_faults: ground.max_faults,
                    },
                });
            }
        }
        jobs
    }
}

/// Removes what an earlier run has left, so that it is not taken for this one's.
fn remove_results(out: &Path) -> anyhow::Result<()> {
    for name in [RESULTS, DATASET, LOG, ablation::FILE] {
        remove(&out.join(name))?;
    }
    Ok(())
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut json = serde_json::to_string_pretty(value).context("writing the result")?;
    json.push('\n');
    fs::write(path, json).with_context(|| format!("writing {}", path.display()))
}

fn remove(path: &Path) -> anyhow::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

fn print_faults(faults: &[AgentFault]) {
    for fault in faults {
        println!("fault: {fault}");
    }
}

fn print_log_tail(log: &str) {
    const LINES: usize = 20;
    let lines: Vec<&str> = log.lines().collect();
    println!("the end of the agent's log:");
    for line in &lines[lines.len().saturating_sub(LINES)..] {
        println!("  {line}");
    }
}

//! `faceoff eval`: the server's evaluator, run locally.

mod ablation;
mod differences;
mod files;
mod like_server;
mod logs;
mod pool;
mod profile_run;
mod said;
mod table;

use super::{ca_file::CaFile, local_bundle, output::print};
use crate::config::Config;
use anyhow::{Context, ensure};
use clap::Args;
use faceoff_dataset::ARCHIVE_FILE;
use faceoff_runner::AgentEnvironment;
use faceoff_sandbox::affinity;
use faceoff_types::{
    AgentFault, EvaluationResult, MAX_EPISODES_PER_TASK, Profile, Seed, StageRules, Task,
};
use faceoff_worker::CpuLayout;
use files::RESULTS;
use like_server::LikeServer;
use profile_run::EvalSetup;
use said::Said;
use serde::Serialize;
use std::{fs, path::PathBuf};

/// Plays a bundle through the very evaluator that the server runs, prints the result and writes
/// `results.json` and `dataset.zip` to a folder. Exit status 0 only if there is a result, and the agent had no fault.
#[derive(Debug, Args)]
pub struct EvalCommand {
    /// The agent: a folder with agent.toml, a .tar.gz, .tar.zst or .zip, or a container image as docker save writes it
    bundle: PathBuf,
    /// Tasks to play [default: hit,defend,prepare, or the stage's with --like-server]
    #[arg(long = "task", value_name = "TASKS", value_delimiter = ',')]
    tasks: Vec<Task>,
    /// Episodes of each task
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_EPISODES_PER_TASK)))]
    episodes: u32,
    /// Perturbations: ideal, one factor's name, or evaluation [default: evaluation, or the stage's with --like-server]
    #[arg(long)]
    profile: Option<Profile>,
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
    /// End with status 0 also if the agent had faults, as long as there is a result
    #[arg(long)]
    allow_faults: bool,
    /// Print one JSON object, and words to standard error
    #[arg(long)]
    json: bool,
    /// Limits, runtimes and given-up layers, and of [evaluation] weights, tier bounds, magnitudes of perturbations and
    /// faults, as a server's configuration states them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Play by the rules and limits of this server's stage, and say what this machine has otherwise
    #[arg(long, value_name = "URL")]
    like_server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// The stage of that server, by its name or id; may be left out where one is open
    #[arg(long, value_name = "STAGE", requires = "like_server")]
    stage: Option<String>,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct Told<'a> {
    agent: &'a str,
    /// The file of the result.
    results: PathBuf,
    dataset: PathBuf,
    dataset_blake3: &'a str,
    faults: &'a [AgentFault],
    /// As `results.json` has it.
    result: &'a EvaluationResult,
}

impl EvalCommand {
    const fn said(&self) -> Said {
        if self.json { Said::Apart } else { Said::Beside }
    }

    /// Plays, scores, prints and writes.
    ///
    /// # Errors
    /// If the bundle is refused, the agent fails too often, or the platform fails; the error says
    /// which.
    pub fn run(mut self) -> anyhow::Result<()> {
        let mut config = Config::load(self.config.as_deref())?;
        let like = self.like_server.as_deref();
        let like = like
            .map(|url| LikeServer::ask(url, self.ca.path(), self.stage.as_deref()))
            .transpose()?;
        let rules = match &like {
            Some(like) => {
                like.apply(&mut config);
                like.stage().rules.rules.clone()
            }
            None => StageRules {
                profile: Profile::Evaluation,
                tasks: Task::ALL.to_vec(),
                ..config.rules()
            },
        };
        if self.tasks.is_empty() {
            self.tasks = rules.tasks;
        }
        self.tasks.sort_unstable();
        self.tasks.dedup();
        fs::create_dir_all(&self.out)
            .with_context(|| format!("creating {}", self.out.display()))?;
        files::remove_earlier(&self.out)?;
        let scratch = local_bundle::scratch_in(&self.out)?;
        let bundle = local_bundle::open(
            &self.bundle,
            scratch.path(),
            self.no_sandbox,
            &config.bundle,
        )?;
        let runtime = &bundle.manifest.runtime;
        if !self.no_sandbox {
            config.check_runtime(runtime)?;
        }
        let envs = self.environments(&config, runtime)?;
        if let Some(like) = &like {
            like.check_runtime(runtime, &envs[0])?;
            for line in like.told(runtime, &envs[0], &self.given_up(&config)) {
                self.said().line(format_args!("{line}"));
            }
            self.said().line(format_args!(""));
        }

        let mismatch_seed = self
            .mismatch_seed
            .unwrap_or_else(|| self.seed.model_mismatch());
        config
            .check_robot(mismatch_seed)
            .context("the configuration")?;
        let setup = EvalSetup {
            tasks: std::mem::take(&mut self.tasks),
            episodes: self.episodes,
            seed: self.seed,
            mismatch_seed,
            max_faults: config.evaluation.max_faults,
            variation: config.rules().variation,
            said: self.said(),
            scratch: scratch.path().to_owned(),
            bundle,
            envs,
        };
        if self.ablation {
            let faults = ablation::run(&setup, &self.out, self.json)?;
            return self.allow(faults);
        }
        let played = profile_run::play(&setup, self.profile.unwrap_or(rules.profile), &self.out)?;
        let told = Told {
            agent: &setup.bundle.manifest.name,
            results: self.out.join(RESULTS),
            dataset: self.out.join(ARCHIVE_FILE),
            dataset_blake3: &played.archive_blake3,
            faults: &played.faults,
            result: &played.result,
        };
        print(self.json, &told, || {
            format!(
                "{}\n{}\n{}, BLAKE3 {}",
                table::of(told.agent, told.result),
                told.results.display(),
                told.dataset.display(),
                told.dataset_blake3
            )
        })?;
        self.allow(played.faults.len())
    }

    /// Is that so many faults as there may be? What was played counts either way.
    fn allow(&self, faults: usize) -> anyhow::Result<()> {
        ensure!(
            faults == 0 || self.allow_faults,
            "the agent had {faults} fault{}, told above; the result stands, and --allow-faults ends with status 0",
            if faults == 1 { "" } else { "s" }
        );
        Ok(())
    }

    /// Layers of the sandbox that this machine does without.
    fn given_up(&self, config: &Config) -> Vec<String> {
        if self.no_sandbox {
            return vec!["the sandbox (--no-sandbox)".to_owned()];
        }
        let layers = config.sandbox.given_up.iter();
        layers.map(|layer| layer.as_str().to_owned()).collect()
    }

    /// One environment per worker: the server's limits, on CPUs of its own where there are enough.
    fn environments(
        &self,
        config: &Config,
        runtime: &str,
    ) -> anyhow::Result<Vec<AgentEnvironment>> {
        let env = local_bundle::environment(config, runtime, self.no_sandbox);
        let workers = usize::from(self.workers);
        // Those that this process may use: not always the machine's, nor numbered from 0.
        let cpus = affinity::allowed().context("asking for the CPUs of this process")?;
        let layout = CpuLayout::divide(&cpus, workers, 1);
        if layout.shared && workers > 1 {
            self.said().line(format_args!(
                "note: {workers} workers share {} CPUs; results are the same, computation \
                 times may be longer",
                cpus.len()
            ));
        }
        Ok(layout
            .slots
            .into_iter()
            .map(|cpus| AgentEnvironment {
                agent_cpus: cpus.of_agent(0).to_vec(),
                ..env.clone()
            })
            .collect())
    }
}

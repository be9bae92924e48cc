//! `faceoff eval`: the server's evaluator, run locally.

mod ablation;
mod differences;
mod files;
mod like_server;
mod pool;
mod profile_run;
mod table;

use super::local_bundle;
use crate::config::Config;
use anyhow::Context;
use clap::Args;
use faceoff_dataset::ARCHIVE_FILE;
use faceoff_runner::AgentEnvironment;
use faceoff_sandbox::affinity;
use faceoff_types::{MAX_EPISODES_PER_TASK, Profile, Seed, StageRules, Task};
use faceoff_worker::CpuLayout;
use files::RESULTS;
use like_server::LikeServer;
use profile_run::EvalSetup;
use std::{fs, path::PathBuf};

/// Plays a bundle through the very evaluator that the server runs, prints the result and writes
/// `results.json` and `dataset.zip` to a folder. Exit status 0 only if there is a result.
#[derive(Debug, Args)]
pub struct EvalCommand {
    /// The agent: a folder with agent.toml, or a .tar.gz, .tar.zst or .zip
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
    /// Limits, runtimes and given-up layers, and of [evaluation] weights, tier bounds, magnitudes of perturbations and
    /// faults, as a server's configuration states them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Play by the rules and limits of this server's stage, and say what this machine has otherwise
    #[arg(long, value_name = "URL")]
    like_server: Option<String>,
    /// The stage of that server, by its name or id; may be left out where one is open
    #[arg(long, value_name = "STAGE", requires = "like_server")]
    stage: Option<String>,
}

impl EvalCommand {
    /// Plays, scores, prints and writes.
    ///
    /// # Errors
    /// If the bundle is refused, the agent fails too often, or the platform fails; the error says
    /// which.
    pub fn run(mut self) -> anyhow::Result<()> {
        let mut config = Config::load(self.config.as_deref())?;
        let like = self.like_server.as_deref();
        let like = like
            .map(|url| LikeServer::ask(url, self.stage.as_deref()))
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
                println!("{line}");
            }
            println!("");
        }

        let mismatch_seed = self
            .mismatch_seed
            .unwrap_or_else(|| self.seed.model_mismatch());
        config
            .check_robot(mismatch_seed)
            .context("the configuration")?;
        let setup = EvalSetup {
            tasks: self.tasks,
            episodes: self.episodes,
            seed: self.seed,
            mismatch_seed,
            max_faults: config.evaluation.max_faults,
            variation: config.rules().variation,
            scratch: scratch.path().to_owned(),
            bundle,
            envs,
        };
        if self.ablation {
            return ablation::run(&setup, &self.out);
        }
        let played = profile_run::play(&setup, self.profile.unwrap_or(rules.profile), &self.out)?;
        let agent = &setup.bundle.manifest.name;
        print!("{}", table::of(agent, &played.result));
        println!(
            "\n{}\n{}, BLAKE3 {}",
            self.out.join(RESULTS).display(),
            self.out.join(ARCHIVE_FILE).display(),
            played.archive_blake3
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
                agent_cpus: cpus.of_agent(0).to_vec(),
                ..env.clone()
            })
            .collect())
    }
}

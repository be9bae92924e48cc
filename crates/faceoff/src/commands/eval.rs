//! `faceoff eval`: evaluates an agent on this machine with the server's evaluator. A *profile* is a set of perturbations of the
//! simulation, e.g. noise or model mismatch, the robot's deviation from its model.

mod ablation;
mod differences;
mod files;
mod logs;
mod pool;
mod profile_run;
mod seeds;
mod server_stage;
mod table;

use super::{ca_file::CaFile, local_bundle, output::print, side_notes::Notes};
use crate::competition::{competition, parse_profile, parse_task};
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
use profile_run::EvalSetup;
use seeds::NamedSeed;
use serde::Serialize;
use server_stage::ServerStage;
use std::{fs, path::PathBuf};

/// Evaluates a bundle locally with the server's own evaluator, prints the result and writes `results.json` and
/// `dataset.zip` to a folder. The exit status is 0 only if there is a result and the agent had no fault.
#[derive(Debug, Args)]
pub struct EvalCommand {
    /// The agent: a folder with agent.toml, a .tar.gz, .tar.zst or .zip, or a container image written by docker save
    bundle: PathBuf,
    /// Tasks to evaluate [default: hit,defend,prepare, or the stage's with --like-server]
    #[arg(long = "task", value_name = "TASKS", value_delimiter = ',', value_parser = parse_task)]
    tasks: Vec<Task>,
    /// Episodes per task
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_EPISODES_PER_TASK)))]
    episodes: u32,
    /// Perturbations: ideal, the name of one, or evaluation [default: evaluation, or the stage's with --like-server]
    #[arg(long, value_parser = parse_profile)]
    profile: Option<Profile>,
    /// Run the same episodes in six profiles (ideal, each of the four perturbations of evaluation alone, and evaluation) and
    /// compare them; writes ablation.json and a folder for each profile
    #[arg(long, conflicts_with = "profile")]
    ablation: bool,
    /// A number, or 64 hexadecimal digits; the same seed gives the same episodes everywhere. Several seeds, as in 1,2,3, are
    /// evaluated one after the other, each into a folder seed-N, and together
    #[arg(
        long = "seed",
        value_name = "SEEDS",
        default_value = "0",
        value_delimiter = ','
    )]
    seeds: Vec<NamedSeed>,
    /// Seed of the season's model mismatch [default: derived from the seed]
    #[arg(long, value_name = "HEX")]
    mismatch_seed: Option<Seed>,
    /// Number of agents that run in parallel; results do not depend on it, but computation times may
    #[arg(long, value_name = "W", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: u16,
    /// Folder for results.json and dataset.zip; files of an earlier run are replaced
    #[arg(long, value_name = "DIR", default_value = "faceoff-eval")]
    out: PathBuf,
    /// Run the agent without a sandbox, with your own environment
    #[arg(long)]
    no_sandbox: bool,
    /// Exit with status 0 even if the agent had faults, as long as there is a result
    #[arg(long)]
    allow_faults: bool,
    /// Print one JSON object, and notes to standard error
    #[arg(long)]
    json: bool,
    /// A server's configuration, for limits, runtimes, disabled layers of the sandbox, and the weights, tier bounds,
    /// perturbations and allowed faults of [evaluation]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Use the rules and limits of this server's stage, and report how this machine differs from the server
    #[arg(long, value_name = "URL")]
    like_server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Name or id of that server's stage [default: the open stage]
    #[arg(long, value_name = "STAGE", requires = "like_server")]
    stage: Option<String>,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct EvalView<'a> {
    agent: &'a str,
    /// Path of `results.json`.
    results: PathBuf,
    dataset: PathBuf,
    dataset_blake3: &'a str,
    faults: &'a [AgentFault],
    /// As `results.json` has it.
    result: &'a EvaluationResult,
}

impl EvalCommand {
    const fn notes(&self) -> Notes {
        Notes::beside(self.json)
    }

    /// Evaluates the bundle, prints the result and writes the files.
    ///
    /// # Errors
    /// If the bundle is refused, or the agent or the platform fails; the error says which.
    pub fn run(mut self) -> anyhow::Result<()> {
        let mut config = Config::load(self.config.as_deref())?;
        let url = self.like_server.as_deref();
        let server_stage = url
            .map(|url| ServerStage::fetch(url, self.ca.path(), self.stage.as_deref()))
            .transpose()?;
        let rules = match &server_stage {
            Some(server_stage) => {
                server_stage.apply(&mut config);
                server_stage.stage().rules.rules.clone()
            }
            None => StageRules {
                profile: competition().counting_profile,
                tasks: competition().task_names().collect(),
                ..config.rules()
            },
        };
        if !self.no_sandbox
            && let Some(note) =
                local_bundle::give_up_unavailable_layers(&mut config, &[&self.bundle])?
        {
            self.notes().print(format_args!("{note}"));
        }
        if self.tasks.is_empty() {
            self.tasks = rules.tasks;
        }
        for task in &self.tasks {
            competition().find_task(task.as_str())?;
        }
        competition().find_profile(rules.profile.as_str())?;
        let is_chosen = |task: &Task| self.tasks.contains(task);
        self.tasks = competition().task_names().filter(is_chosen).collect();
        fs::create_dir_all(&self.out)
            .with_context(|| format!("creating {}", self.out.display()))?;
        files::remove_earlier(&self.out)?;
        let scratch = local_bundle::create_scratch(&self.out)?;
        let bundle = local_bundle::open(
            &self.bundle,
            scratch.path(),
            self.no_sandbox,
            &config.bundle,
        )?;
        let runtime = &bundle.manifest.runtime;
        if !self.no_sandbox {
            local_bundle::adopt_default_runtime(&mut config);
            if server_stage.is_none() {
                local_bundle::check_runtime(&config, runtime)?;
            } else {
                // Whether the stage allows the runtime is checked below.
                config.check_runtime(runtime)?;
            }
        }
        let envs = self.environments(&config, runtime)?;
        if let Some(server_stage) = &server_stage {
            server_stage.check_runtime(runtime, &envs[0])?;
            for line in server_stage.report(runtime, &envs[0], &self.disabled_layers(&config)) {
                self.notes().print(format_args!("{line}"));
            }
            self.notes().print(format_args!(""));
        }

        let seeds: Vec<(NamedSeed, Seed)> = std::mem::take(&mut self.seeds)
            .into_iter()
            .map(|named| {
                let derived = named.seed.model_mismatch();
                (named, self.mismatch_seed.unwrap_or(derived))
            })
            .collect();
        for (index, (named, _)) in seeds.iter().enumerate() {
            let is_repeated = seeds[..index]
                .iter()
                .any(|(other, _)| other.seed == named.seed);
            ensure!(
                !is_repeated,
                "--seed: a seed is given twice; its episodes would count twice"
            );
        }
        for (_, mismatch_seed) in &seeds {
            config
                .check_season_magnitudes(*mismatch_seed)
                .context("the configuration")?;
        }
        let (first, mismatch_seed) = &seeds[0];
        let mut setup = EvalSetup {
            tasks: std::mem::take(&mut self.tasks),
            episodes: self.episodes,
            seed: first.seed,
            mismatch_seed: *mismatch_seed,
            max_faults: config.evaluation.max_faults,
            variation: config.rules().variation,
            notes: self.notes(),
            scratch: scratch.path().to_owned(),
            bundle,
            envs,
        };
        if seeds.len() > 1 {
            ensure!(!self.ablation, "--ablation takes one seed");
            let profile = self.profile.unwrap_or(rules.profile);
            let faults = seeds::run_seeds(&mut setup, &seeds, profile, &self.out, self.json)?;
            return self.check_faults(faults);
        }
        if self.ablation {
            let faults = ablation::run(&setup, &self.out, self.json)?;
            return self.check_faults(faults);
        }
        let outcome =
            profile_run::run_profile(&setup, self.profile.unwrap_or(rules.profile), &self.out)?;
        let view = EvalView {
            agent: &setup.bundle.manifest.name,
            results: self.out.join(RESULTS),
            dataset: self.out.join(ARCHIVE_FILE),
            dataset_blake3: &outcome.archive_blake3,
            faults: &outcome.faults,
            result: &outcome.result,
        };
        print(self.json, &view, |view| {
            format!(
                "{}\n{}\n{}, BLAKE3 {}",
                table::result_table(view.agent, view.result),
                view.results.display(),
                view.dataset.display(),
                view.dataset_blake3
            )
        })?;
        self.check_faults(outcome.faults.len())
    }

    /// Fails if the agent had faults, unless `--allow-faults` is given. The result is valid in both cases.
    fn check_faults(&self, faults: usize) -> anyhow::Result<()> {
        ensure!(
            faults == 0 || self.allow_faults,
            "the agent had {faults} fault{}, listed above; the result is valid, and with --allow-faults the exit status is 0",
            if faults == 1 { "" } else { "s" }
        );
        Ok(())
    }

    /// Layers (protections) of the sandbox that are not used on this machine.
    fn disabled_layers(&self, config: &Config) -> Vec<String> {
        if self.no_sandbox {
            return vec!["the sandbox (--no-sandbox)".to_owned()];
        }
        let layers = config.sandbox.given_up.iter();
        layers.map(|layer| layer.as_str().to_owned()).collect()
    }

    /// One environment per worker, with the server's limits and, if there are enough, separate CPUs.
    fn environments(
        &self,
        config: &Config,
        runtime: &str,
    ) -> anyhow::Result<Vec<AgentEnvironment>> {
        let env = local_bundle::environment(config, runtime, self.no_sandbox);
        let workers = usize::from(self.workers);
        // The process may be restricted to some of the machine's CPUs.
        let cpus = affinity::allowed_cpus().context("reading the CPU affinity of this process")?;
        let layout = CpuLayout::divide(&cpus, workers, 1);
        if layout.agents_share_cpus && workers > 1 {
            self.notes().print(format_args!(
                "note: {workers} workers share {} CPUs; results do not change, but computation \
                times may be longer",
                cpus.len()
            ));
        }
        Ok(layout
            .slots
            .into_iter()
            .map(|cpus| AgentEnvironment {
                agent_cpus: cpus.agent_cpus(0).to_vec(),
                ..env.clone()
            })
            .collect())
    }
}

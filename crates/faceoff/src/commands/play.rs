//! `faceoff play`: one game between two bundles.

mod table;

use super::local_bundle;
use crate::config::Config;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_dataset::game::{GAME_FILE, clear_game, side_file};
use faceoff_episode::{GameStepRow, RallyRow};
use faceoff_runner::{
    AgentEnvironment, GameObserver, GameReport, GameSpec, PlatformFault, bundle::Bundle, run_game,
};
use faceoff_sandbox::affinity;
use faceoff_types::{
    GAME_WINDOWS, GameLimits, MAX_GAME_STEPS, Profile, Ruleset, Seed, Side, WINDOW_STEPS,
};
use faceoff_worker::CpuLayout;
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

/// The score beside the recording.
const RESULTS: &str = "results.json";
/// What an evaluation writes, with a score of the same name.
const DATASET: &str = "dataset.zip";

/// Plays one game between two agents, each in a sandbox of its own, prints the result and writes
/// `results.json`, `game.zip` (which `faceoff verify` simulates again), `side-1.zip` and `side-2.zip` (what each
/// side may have of it) to a folder. Exit status 0 only if there is a result; a forfeit is one.
#[derive(Debug, Args)]
pub struct PlayCommand {
    /// The first side's agent: a folder with agent.toml, or a .tar.gz, .tar.zst or .zip
    bundle_a: PathBuf,
    /// The second side's agent; it may be the same
    bundle_b: PathBuf,
    /// Control steps of the game; 50 are a second
    #[arg(long, value_name = "N", default_value_t = GAME_WINDOWS * WINDOW_STEPS, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_GAME_STEPS)))]
    steps: u32,
    /// Perturbations: ideal, one factor's name, or evaluation
    #[arg(long, default_value = "evaluation")]
    profile: Profile,
    /// A number, or 64 hexadecimal digits; the same seed gives the same serves and noise everywhere
    #[arg(long, default_value = "0")]
    seed: Seed,
    /// Seed of the season's model mismatch; derived from the seed if left out
    #[arg(long, value_name = "HEX")]
    mismatch_seed: Option<Seed>,
    /// Folder for results and recordings; those of an earlier game are replaced
    #[arg(long, value_name = "DIR", default_value = "faceoff-game")]
    out: PathBuf,
    /// Print the result as JSON, as results.json has it
    #[arg(long)]
    json: bool,
    /// Run your own agents without isolation, with your own environment
    #[arg(long)]
    no_sandbox: bool,
    /// Limits, runtimes and given-up layers, and of [evaluation] magnitudes of perturbations, as a server's
    /// configuration states them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

impl PlayCommand {
    /// Plays, scores, prints and writes.
    ///
    /// # Errors
    /// If a bundle is refused or the platform fails; the error says which.
    pub fn run(self) -> anyhow::Result<()> {
        let config = Config::load(self.config.as_deref())?;
        let mismatch_seed = self
            .mismatch_seed
            .unwrap_or_else(|| self.seed.model_mismatch());
        config
            .check_robot(mismatch_seed)
            .context("the configuration")?;
        fs::create_dir_all(&self.out)
            .with_context(|| format!("creating {}", self.out.display()))?;
        if self.out.join(DATASET).exists() {
            bail!(
                "{} holds the results of an evaluation: name another folder with --out",
                self.out.display()
            );
        }
        // Whatever comes of this one, an earlier game is not it.
        let results = self.out.join(RESULTS);
        remove(&results)?;
        clear_game(&self.out).with_context(|| format!("clearing {}", self.out.display()))?;
        let scratch = local_bundle::scratch_in(&self.out)?;
        let open = |path: &Path, name: &str| -> anyhow::Result<Bundle> {
            let scratch = scratch.path().join(name);
            fs::create_dir(&scratch).with_context(|| format!("creating {}", scratch.display()))?;
            local_bundle::open(path, &scratch, self.no_sandbox, &config.bundle)
                .with_context(|| path.display().to_string())
        };
        let bundles = [
            open(&self.bundle_a, "first")?,
            open(&self.bundle_b, "second")?,
        ];
        let envs = self.environments(&config, &bundles)?;
        let spec = GameSpec {
            ruleset: Ruleset::CURRENT,
            steps: self.steps,
            profile: self.profile,
            seed: self.seed,
            mismatch_seed,
            limits: GameLimits::default(),
            platform_retries: 0,
            perturbations: config.rules().variation.perturbations,
        };
        let mut progress = Progress::new(self.steps)?;
        let played = run_game(
            &spec,
            bundles.each_ref(),
            envs.each_ref(),
            &self.out,
            &mut progress,
        );
        progress.bar.finish_and_clear();
        let GameReport { archives, logs, .. } =
            played.map_err(explained).context("there is no result")?;
        let mut json = serde_json::to_string_pretty(&archives.score).context("the result")?;
        json.push('\n');
        let writing = || format!("writing {}", results.display());
        let partial = results.with_extension("json.partial");
        fs::write(&partial, &json).with_context(writing)?;
        fs::rename(&partial, &results).with_context(writing)?;
        if self.json {
            print!("{json}");
            return Ok(());
        }
        print!("{}", table::of(&archives.score));
        for (side, outcome) in Side::BOTH.into_iter().zip(&archives.outcome.sides) {
            for fault in &outcome.faults {
                println!("fault: {fault}");
            }
            if !outcome.faults.is_empty() {
                print!("{}", table::log_tail(side, &logs[side.index()]));
            }
        }
        println!(
            "\n{}\n{}, BLAKE3 {}",
            results.display(),
            self.out.join(GAME_FILE).display(),
            archives.game.blake3
        );
        for side in Side::BOTH {
            println!("{}", self.out.join(side_file(side)).display());
        }
        Ok(())
    }

    /// The server's limits, each agent on CPUs of its own where there are enough.
    fn environments(
        &self,
        config: &Config,
        bundles: &[Bundle; 2],
    ) -> anyhow::Result<[AgentEnvironment; 2]> {
        let cpus = affinity::allowed().context("asking for the CPUs of this process")?;
        let layout = CpuLayout::divide(&cpus, 1, 2);
        if layout.shared && !self.json {
            println!(
                "note: the agents share {} CPUs with each other and the simulator; answers may take longer, and \
                 what the others took is told apart",
                cpus.len()
            );
        }
        let of = |agent: usize| {
            let runtime = &bundles[agent].manifest.runtime;
            AgentEnvironment {
                agent_cpus: layout.slots[0].of_agent(agent).to_vec(),
                ..local_bundle::environment(config, runtime, self.no_sandbox)
            }
        };
        Ok([of(0), of(1)])
    }
}

fn remove(path: &Path) -> anyhow::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// What to do about it.
fn explained(fault: PlatformFault) -> anyhow::Error {
    let host_busy = matches!(fault, PlatformFault::HostBusy(_));
    let error = anyhow::Error::new(fault);
    if host_busy {
        error.context(
            "the game was broken, not by an agent: play it again when the machine is less busy",
        )
    } else {
        error.context("the game was broken, not by an agent")
    }
}

/// A bar on standard error, if that is a terminal.
struct Progress {
    bar: ProgressBar,
}

impl Progress {
    fn new(steps: u32) -> anyhow::Result<Self> {
        let style = ProgressStyle::with_template(
            "{msg:9} {bar:40} {pos}/{len} steps, {per_sec}, {eta} left",
        )
        .context("the progress bar's template")?;
        let bar = ProgressBar::new(u64::from(steps)).with_style(style);
        bar.set_message("0 : 0");
        Ok(Self { bar })
    }
}

impl GameObserver for Progress {
    fn stepped(&mut self, _: &GameStepRow<'_>) {
        self.bar.inc(1);
    }

    fn rally_over(&mut self, row: &RallyRow<'_>) {
        let [first, second] = row.score;
        self.bar.set_message(format!("{first} : {second}"));
    }

    fn cancelled(&self) -> bool {
        false
    }
}

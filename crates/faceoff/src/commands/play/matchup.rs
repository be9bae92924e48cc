//! The two bundles of `faceoff play`, and the settings of all games between them.

use super::options::PlayOptions;
use crate::{commands::local_bundle, config::Config};
use anyhow::Context;
use faceoff_runner::{
    AgentEnvironment, GameObserver, GameReport, GameSpec, PlatformFault, bundle::Bundle, run_game,
};
use faceoff_sandbox::affinity;
use faceoff_types::{ForfeitScore, GameLimits, Seed};
use faceoff_worker::CpuLayout;
use std::{fs, path::Path};
use tempfile::TempDir;

/// Two bundles and the settings of their games.
pub(super) struct Matchup {
    bundles: [Bundle; 2],
    envs: [AgentEnvironment; 2],
    /// Settings of a game; each game has its own seed in place of this one's.
    spec: GameSpec,
    /// Holds the unpacked bundles.
    _scratch: TempDir,
}

/// Loads the configuration and checks that its robot can be simulated.
pub(super) fn load_config(options: &PlayOptions) -> anyhow::Result<Config> {
    let config = Config::load(options.config.as_deref())?;
    config
        .check_season_magnitudes(mismatch_seed(options))
        .context("the configuration")?;
    Ok(config)
}

/// The seed of the model mismatch, the robot's deviation from its model.
fn mismatch_seed(options: &PlayOptions) -> Seed {
    options
        .mismatch_seed
        .unwrap_or_else(|| options.seed.model_mismatch())
}

impl Matchup {
    pub(super) fn open(options: &PlayOptions, mut config: Config) -> anyhow::Result<Self> {
        let paths = [options.bundle_a.as_path(), options.bundle_b.as_path()];
        if !options.no_sandbox
            && let Some(note) = local_bundle::give_up_unavailable_layers(&mut config, &paths)?
        {
            if options.json {
                eprintln!("{note}");
            } else {
                println!("{note}");
            }
        }
        let scratch = local_bundle::create_scratch(&options.out)?;
        let open = |path: &Path, name: &str| -> anyhow::Result<Bundle> {
            let scratch = scratch.path().join(name);
            fs::create_dir(&scratch).with_context(|| format!("creating {}", scratch.display()))?;
            local_bundle::open(path, &scratch, options.no_sandbox, &config.bundle)
                .with_context(|| path.display().to_string())
        };
        let bundles = [
            open(&options.bundle_a, "first")?,
            open(&options.bundle_b, "second")?,
        ];
        if !options.no_sandbox {
            local_bundle::adopt_default_runtime(&mut config);
            for bundle in &bundles {
                local_bundle::check_runtime(&config, &bundle.manifest.runtime)?;
            }
        }
        let envs = environments(options, &config, &bundles)?;
        let spec = GameSpec {
            ruleset: crate::competition::competition().ruleset(),
            steps: options.steps,
            profile: options.profile,
            seed: options.seed,
            mismatch_seed: mismatch_seed(options),
            limits: GameLimits::default(),
            forfeit_score: ForfeitScore::TenOrLead,
            platform_retries: 0,
            perturbations: config.rules().variation.perturbations,
        };
        Ok(Self {
            bundles,
            envs,
            spec,
            _scratch: scratch,
        })
    }

    /// The agents' names, in the sequence of the command line.
    pub(super) fn agents(&self) -> [&str; 2] {
        self.bundles
            .each_ref()
            .map(|bundle| bundle.manifest.name.as_str())
    }

    pub(super) const fn spec(&self) -> &GameSpec {
        &self.spec
    }

    /// Plays one game; `swapped`: the second bundle is at home.
    pub(super) fn play(
        &self,
        seed: Seed,
        swapped: bool,
        out: &Path,
        observer: &mut dyn GameObserver,
    ) -> Result<GameReport, PlatformFault> {
        let (mut bundles, mut envs) = (self.bundles.each_ref(), self.envs.each_ref());
        if swapped {
            bundles.reverse();
            envs.reverse();
        }
        let spec = GameSpec {
            seed,
            ..self.spec.clone()
        };
        run_game(&spec, bundles, envs, out, observer)
    }
}

/// The server's limits, with separate CPUs for each agent if there are enough.
fn environments(
    options: &PlayOptions,
    config: &Config,
    bundles: &[Bundle; 2],
) -> anyhow::Result<[AgentEnvironment; 2]> {
    let cpus = affinity::allowed_cpus().context("reading the CPU affinity of this process")?;
    let layout = CpuLayout::divide(&cpus, 1, 2);
    if layout.agents_share_cpus && !options.json {
        println!(
            "note: the agents share {} CPUs with each other and the simulator; answers may take longer, but \
            time lost to other processes is measured separately",
            cpus.len()
        );
    }
    let environment = |agent: usize| {
        let runtime = &bundles[agent].manifest.runtime;
        AgentEnvironment {
            agent_cpus: layout.slots[0].agent_cpus(agent).to_vec(),
            ..local_bundle::environment(config, runtime, options.no_sandbox)
        }
    };
    Ok([environment(0), environment(1)])
}

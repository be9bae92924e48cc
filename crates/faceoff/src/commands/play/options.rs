//! The arguments of `faceoff play`.

use crate::competition::parse_profile;
use clap::Args;
use faceoff_types::{GAME_WINDOWS, MAX_GAME_STEPS, Profile, Seed, WINDOW_STEPS};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct PlayOptions {
    /// The first side's agent: a folder with agent.toml, a .tar.gz, .tar.zst or .zip, or a container image written by
    /// docker save
    pub(super) bundle_a: PathBuf,
    /// The second side's agent; it may be the same bundle
    pub(super) bundle_b: PathBuf,
    /// Control steps per game; 50 steps are one second
    // The default is the length of a tournament game: 90 windows. A window is a stretch of 500 control steps, in which each kind
    // of violation counts at most once.
    #[arg(long, value_name = "N", default_value_t = GAME_WINDOWS * WINDOW_STEPS, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_GAME_STEPS)))]
    pub(super) steps: u32,
    /// Number of mirrored pairs, two games on one seed with swapped sides; recordings go to pair-K/half-1 and
    /// pair-K/half-2
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with = "games")]
    pub(super) pairs: Option<u32>,
    /// Number of games, each with its own seed and alternating home sides; recordings go to game-K
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) games: Option<u32>,
    /// Perturbations of the simulator: ideal (none), evaluation (as on the server), or the name of a single one, such as delay
    #[arg(long, default_value = "evaluation", value_parser = parse_profile)]
    pub(super) profile: Profile,
    /// A number, or 64 hexadecimal digits; the same seed gives the same serves and noise everywhere
    #[arg(long, default_value = "0")]
    pub(super) seed: Seed,
    /// Seed of the model mismatch, by which the simulated robot differs from its published model in a season [default: derived
    /// from --seed]
    #[arg(long, value_name = "HEX")]
    pub(super) mismatch_seed: Option<Seed>,
    /// Folder for results and recordings; files of an earlier game are replaced
    #[arg(long, value_name = "DIR", default_value = "faceoff-game")]
    pub(super) out: PathBuf,
    /// Print the content of results.json
    #[arg(long)]
    pub(super) json: bool,
    /// Run the agents without a sandbox, with your own environment
    #[arg(long)]
    pub(super) no_sandbox: bool,
    /// A server's configuration, for limits, runtimes, disabled layers of the sandbox, and the perturbations of [evaluation]
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
}

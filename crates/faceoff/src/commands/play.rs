//! `faceoff play`: one game or a series of games between two bundles. A *mirrored pair* is two games on one seed with swapped
//! sides.

mod attempt;
mod bar;
mod matchup;
mod options;
mod platform_fault;
mod results;
mod series;
mod series_results;
mod table;

use super::{series_folders, side_notes::Notes};
use anyhow::{Context, bail};
use attempt::{Attempt, GamePlayer};
use bar::Bar;
use clap::Args;
use faceoff_dataset::game::{GAME_FILE, remove_game, side_file};
use faceoff_runner::GameReport;
use faceoff_types::Side;
use matchup::Matchup;
use options::PlayOptions;
use platform_fault::with_advice;
use results::Results;
use series_results::SeriesKind;
use std::fs;

/// File of an evaluation, whose `results.json` would be overwritten.
const DATASET: &str = "dataset.zip";

/// Plays one game between two agents, each in its own sandbox, prints the result and writes to a folder:
/// `results.json`, `game.zip` (for `faceoff verify`), `side-1.zip` and `side-2.zip` (the datasets of the
/// sides) and `clips` (for replays). The exit status is 0 only if there is a result; a forfeit is a result.
/// An agent that never answers ends the game without one.
#[derive(Debug, Args)]
pub struct PlayCommand {
    #[command(flatten)]
    options: PlayOptions,
}

impl PlayCommand {
    /// Plays the game or series, prints the result and writes the files.
    ///
    /// # Errors
    /// If a bundle is refused or the platform fails; the error says which.
    pub fn run(self) -> anyhow::Result<()> {
        let options = &self.options;
        let config = matchup::load_config(options)?;
        let out = &options.out;
        fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
        let series = match (options.pairs, options.games) {
            (Some(pairs), _) => Some((SeriesKind::MirroredPairs, pairs)),
            (None, Some(games)) => Some((SeriesKind::Games, games)),
            (None, None) => None,
        };
        if out.join(DATASET).exists() {
            bail!(
                "{} contains the results of an evaluation: name another folder with --out",
                out.display()
            );
        }
        if let Some(earlier) = series_folders::find_first(out) {
            bail!(
                "{} contains the recordings of an earlier series: name another folder with --out, or remove it",
                earlier.display()
            );
        }
        // If this game has no result, the files of an earlier game must not be mistaken for it.
        let results = Results::clear_in(out)?;
        remove_game(out).with_context(|| format!("clearing {}", out.display()))?;
        let matchup = Matchup::open(options, config)?;
        match series {
            Some((kind, count)) => series::play(options, &matchup, kind, count, &results),
            None => play_game(options, &matchup, &results),
        }
    }
}

fn play_game(options: &PlayOptions, matchup: &Matchup, results: &Results) -> anyhow::Result<()> {
    let bar = Bar::steps(options.steps)?;
    let attempt = Attempt {
        seed: options.seed,
        swapped: false,
        out: &options.out,
    };
    let played = GamePlayer::new(matchup, Notes::beside(options.json)).play(&attempt, &bar);
    bar.finish();
    let GameReport { archives, logs, .. } =
        played.map_err(with_advice).context("there is no result")?;
    let json = results.write(&archives.score)?;
    if options.json {
        print!("{json}");
        return Ok(());
    }
    print!("{}", table::game_table(&archives.score));
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
        results.path().display(),
        options.out.join(GAME_FILE).display(),
        archives.game.blake3
    );
    for side in Side::BOTH {
        println!("{}", options.out.join(side_file(side)).display());
    }
    Ok(())
}

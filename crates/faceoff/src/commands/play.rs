//! `faceoff play`: one game between two bundles, or a series of them.

mod bar;
mod broken;
mod options;
mod results;
mod series;
mod series_results;
mod setting;
mod table;

use anyhow::{Context, bail};
use bar::Bar;
use broken::explained;
use clap::Args;
use faceoff_dataset::game::{GAME_FILE, clear_game, side_file};
use faceoff_runner::GameReport;
use faceoff_types::Side;
use options::PlayOptions;
use results::Results;
use series_results::Kind;
use setting::Setting;
use std::fs;

/// What an evaluation writes, with a score of the same name.
const DATASET: &str = "dataset.zip";

/// Plays one game between two agents, each in a sandbox of its own, prints the result and writes
/// `results.json`, `game.zip` (which `faceoff verify` simulates again), `side-1.zip` and `side-2.zip` (what each
/// side may have of it) and `clips` (what replays are drawn from) to a folder. Exit status 0 only if there is a result; a forfeit is one.
#[derive(Debug, Args)]
pub struct PlayCommand {
    #[command(flatten)]
    options: PlayOptions,
}

impl PlayCommand {
    /// Plays, scores, prints and writes.
    ///
    /// # Errors
    /// If a bundle is refused or the platform fails; the error says which.
    pub fn run(self) -> anyhow::Result<()> {
        let options = &self.options;
        let config = setting::config(options)?;
        let out = &options.out;
        fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
        let series = match (options.pairs, options.games) {
            (Some(pairs), _) => Some((Kind::MirroredPairs, pairs)),
            (None, Some(games)) => Some((Kind::Games, games)),
            (None, None) => None,
        };
        if out.join(DATASET).exists() {
            bail!(
                "{} holds the results of an evaluation: name another folder with --out",
                out.display()
            );
        }
        if let Some(earlier) = series::earlier(out) {
            bail!(
                "{} holds the recordings of an earlier series: name another folder with --out, or remove that one",
                earlier.display()
            );
        }
        // Whatever comes of this one, an earlier game is not it.
        let results = Results::clear_in(out)?;
        clear_game(out).with_context(|| format!("clearing {}", out.display()))?;
        let setting = Setting::open(options, config)?;
        match series {
            Some((kind, wanted)) => series::play(options, &setting, kind, wanted, &results),
            None => one_game(options, &setting, &results),
        }
    }
}

fn one_game(options: &PlayOptions, setting: &Setting, results: &Results) -> anyhow::Result<()> {
    let mut bar = Bar::steps(options.steps)?;
    let played = setting.play(options.seed, false, &options.out, &mut bar);
    bar.finish();
    let GameReport { archives, logs, .. } =
        played.map_err(explained).context("there is no result")?;
    let json = results.write(&archives.score)?;
    if options.json {
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
        results.path().display(),
        options.out.join(GAME_FILE).display(),
        archives.game.blake3
    );
    for side in Side::BOTH {
        println!("{}", options.out.join(side_file(side)).display());
    }
    Ok(())
}

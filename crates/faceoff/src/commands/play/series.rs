//! Many games between the same two bundles.

use super::{
    bar::Bar,
    broken::explained,
    options::PlayOptions,
    results::Results,
    series_results::{Kind, Series, SeriesGame, SeriesResults},
    setting::Setting,
    table,
};
use anyhow::Context;
use faceoff_dataset::game::GAME_FILE;
use faceoff_runner::{GameReport, PlatformFault};
use std::path::{Path, PathBuf};

/// How often a game is played that the host broke, before the series ends.
const ATTEMPTS: u32 = 5;

/// What of an earlier series is in a folder.
pub(super) fn earlier(out: &Path) -> Option<PathBuf> {
    ["pair-1", "game-1"]
        .map(|name| out.join(name))
        .into_iter()
        .find(|path| path.exists())
}

/// Plays, prints line by line and writes: after each pair or game, so that a series that ends early has results too.
pub(super) fn play(
    options: &PlayOptions,
    setting: &Setting,
    kind: Kind,
    wanted: u32,
    results: &Results,
) -> anyhow::Result<()> {
    let halves: &[bool] = match kind {
        Kind::MirroredPairs => &[false, true],
        Kind::Games => &[false],
    };
    let mut bar = Bar::steps(options.steps)?;
    let all_steps = u64::from(options.steps) * u64::from(wanted) * halves.len() as u64;
    let mut done_steps = 0;
    let series = Series {
        kind,
        wanted,
        agents: setting.agents(),
        spec: setting.spec(),
    };
    let mut games = Vec::new();
    let mut json = String::new();
    if !options.json {
        println!("{}", table::series_head(setting.agents(), kind));
    }
    for number in 1..=wanted {
        let begun = games.len();
        for (half, swapped) in (1..).zip(halves) {
            let (seed, swapped, folder) = match kind {
                Kind::MirroredPairs => (
                    options.seed.derive("pair", &number.to_le_bytes()),
                    *swapped,
                    format!("pair-{number}/half-{half}"),
                ),
                Kind::Games => (
                    options.seed.derive("game", &number.to_le_bytes()),
                    number % 2 == 0,
                    format!("game-{number}"),
                ),
            };
            bar.next(&folder, done_steps, all_steps);
            let out = options.out.join(&folder);
            let report = persistently(|| setting.play(seed, swapped, &out, &mut bar), &folder)?;
            let score = &report.archives.score;
            Results::clear_in(&out)?.write(score)?;
            done_steps += u64::from(options.steps);
            let pair = (kind == Kind::MirroredPairs).then_some(number);
            games.push(SeriesGame::of(score, folder, pair, swapped)?);
        }
        let told = SeriesResults::of(&series, &games)?;
        json = results.write(&told)?;
        if !options.json {
            bar.above(|| println!("{}", table::series_line(number, &games[begun..])));
            if number == wanted {
                bar.finish();
                print!("{}", table::series(&told));
            }
        }
    }
    bar.finish();
    if options.json {
        print!("{json}");
    } else {
        println!(
            "\n{}\n{}",
            results.path().display(),
            options.out.join("*").join(GAME_FILE).display()
        );
    }
    Ok(())
}

/// Plays a game again that the host broke.
fn persistently(
    mut play: impl FnMut() -> Result<GameReport, PlatformFault>,
    folder: &str,
) -> anyhow::Result<GameReport> {
    let mut attempt = 1;
    loop {
        match play() {
            Err(PlatformFault::HostBusy(_)) if attempt < ATTEMPTS => attempt += 1,
            played => {
                return played
                    .map_err(explained)
                    .with_context(|| format!("{folder} has no result; those before it stand"));
            }
        }
    }
}

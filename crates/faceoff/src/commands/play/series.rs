//! A series of games between the same two bundles.

use super::{
    bar::Bar,
    matchup::Matchup,
    options::PlayOptions,
    platform_fault::with_advice,
    results::Results,
    series_results::{Kind, Series, SeriesGame, SeriesResults},
    table,
};
use anyhow::Context;
use faceoff_dataset::game::GAME_FILE;
use faceoff_runner::{GameReport, PlatformFault};
use std::path::{Path, PathBuf};

/// Attempts per game; after that many failures on a busy host, the series ends.
const ATTEMPTS: u32 = 5;

/// A recording of an earlier series in a folder.
pub(super) fn find_earlier(out: &Path) -> Option<PathBuf> {
    ["pair-1", "game-1"]
        .map(|name| out.join(name))
        .into_iter()
        .find(|path| path.exists())
}

/// Plays the series. Results are printed and written after each pair or game, so that an interrupted series has some,
/// too.
pub(super) fn play(
    options: &PlayOptions,
    matchup: &Matchup,
    kind: Kind,
    count: u32,
    results: &Results,
) -> anyhow::Result<()> {
    let halves: &[bool] = match kind {
        Kind::MirroredPairs => &[false, true],
        Kind::Games => &[false],
    };
    let mut bar = Bar::steps(options.steps)?;
    let all_steps = u64::from(options.steps) * u64::from(count) * halves.len() as u64;
    let mut done_steps = 0;
    let series = Series {
        kind,
        count,
        agents: matchup.agents(),
        spec: matchup.spec(),
    };
    let mut games = Vec::new();
    let mut json = String::new();
    if !options.json {
        println!("{}", table::series_head(matchup.agents(), kind));
    }
    for number in 1..=count {
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
            let report =
                play_with_retries(|| matchup.play(seed, swapped, &out, &mut bar), &folder)?;
            let score = &report.archives.score;
            Results::clear_in(&out)?.write(score)?;
            done_steps += u64::from(options.steps);
            let pair = (kind == Kind::MirroredPairs).then_some(number);
            games.push(SeriesGame::new(score, folder, pair, swapped)?);
        }
        let summary = SeriesResults::new(&series, &games)?;
        json = results.write(&summary)?;
        if !options.json {
            bar.above(|| println!("{}", table::series_line(number, &games[begun..])));
            if number == count {
                bar.finish();
                print!("{}", table::series_table(&summary));
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

/// Plays a game, and plays it again if the host was too busy.
fn play_with_retries(
    mut play: impl FnMut() -> Result<GameReport, PlatformFault>,
    folder: &str,
) -> anyhow::Result<GameReport> {
    let mut attempt = 1;
    loop {
        match play() {
            Err(PlatformFault::HostBusy(_)) if attempt < ATTEMPTS => attempt += 1,
            result => {
                return result.map_err(with_advice).with_context(|| {
                    format!("{folder} has no result; earlier results remain valid")
                });
            }
        }
    }
}

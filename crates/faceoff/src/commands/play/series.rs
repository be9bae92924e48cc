//! A series of games between the same two bundles.

use super::{
    attempt::{Attempt, AttemptError, GamePlayer},
    bar::Bar,
    matchup::Matchup,
    options::PlayOptions,
    platform_fault::with_advice,
    results::Results,
    series_results::{Series, SeriesGame, SeriesKind, SeriesResults},
    table,
};
use crate::commands::{series_folders, side_notes::Notes};
use anyhow::Context;
use faceoff_dataset::game::GAME_FILE;
use faceoff_runner::{GameReport, PlatformFault};

/// Attempts per game; after that many failures on a busy host, the series ends.
const MAX_ATTEMPTS: u32 = 5;

/// Plays the series. Results are printed and written after each pair or game, so that an interrupted series has some,
/// too.
pub(super) fn play(
    options: &PlayOptions,
    matchup: &Matchup,
    kind: SeriesKind,
    count: u32,
    results: &Results,
) -> anyhow::Result<()> {
    // The games of one pair or, without pairs, the single game: whether each has swapped sides, so that the second agent is home.
    // Single games swap them by their number instead, below.
    let halves: &[bool] = match kind {
        SeriesKind::MirroredPairs => &[false, true],
        SeriesKind::Games => &[false],
    };
    let mut bar = Bar::steps(options.steps)?;
    let total_steps = u64::from(options.steps) * u64::from(count) * halves.len() as u64;
    let mut finished_steps = 0;
    let series = Series {
        kind,
        count,
        agents: matchup.agents(),
        spec: matchup.spec(),
    };
    let mut game_player = GamePlayer::new(matchup, Notes::beside(options.json));
    let mut games = Vec::new();
    let mut json = String::new();
    if !options.json {
        println!("{}", table::series_head(matchup.agents(), kind));
    }
    for number in 1..=count {
        let first_game = games.len();
        for (half, swapped) in (1..).zip(halves) {
            let (seed, swapped, folder) = match kind {
                SeriesKind::MirroredPairs => (
                    options.seed.derive("pair", &number.to_le_bytes()),
                    *swapped,
                    series_folders::of_half(number, half),
                ),
                SeriesKind::Games => (
                    options.seed.derive("game", &number.to_le_bytes()),
                    number % 2 == 0,
                    series_folders::of_game(number),
                ),
            };
            bar.start_game(&folder, finished_steps, total_steps);
            let out = options.out.join(&folder);
            let attempt = Attempt {
                seed,
                swapped,
                out: &out,
            };
            let report = play_with_retries(|| game_player.play(&attempt, &bar), &folder)?;
            let score = &report.archives.score;
            Results::clear_in(&out)?.write(score)?;
            finished_steps += u64::from(options.steps);
            let pair = (kind == SeriesKind::MirroredPairs).then_some(number);
            games.push(SeriesGame::new(score, folder, pair, swapped)?);
        }
        let summary = SeriesResults::new(&series, &games)?;
        json = results.write(&summary)?;
        if !options.json {
            bar.print_above(|| println!("{}", table::series_line(number, &games[first_game..])));
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
    mut play: impl FnMut() -> Result<GameReport, AttemptError>,
    folder: &str,
) -> anyhow::Result<GameReport> {
    let mut attempt = 1;
    loop {
        match play() {
            Err(AttemptError::Platform(PlatformFault::HostBusy(_))) if attempt < MAX_ATTEMPTS => {
                attempt += 1
            }
            result => {
                return result.map_err(with_advice).with_context(|| {
                    format!("{folder} has no result; earlier results remain valid")
                });
            }
        }
    }
}

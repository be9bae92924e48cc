//! Tables of `faceoff play`: the result of a game, and of a series of games.

use super::series_results::{SeriesGame, SeriesKind, SeriesResults};
use crate::commands::table_cells::{computation_time_cell, violation_cells, violation_headings};
use faceoff_scoring::tournament::GameScore;
use faceoff_types::Side;
use std::fmt::Write as _;

/// The result of a game as text. The columns from `ee` to `time` count the violations of each constraint: end effector, links,
/// joint positions, joint velocities, computation time.
pub(super) fn game_table(game: &GameScore) -> String {
    let mut lines = Vec::new();
    let [first, second] = &game.sides;
    lines.push(format!(
        "{} against {}: {} ({}), seed {}",
        first.agent, second.agent, game.profile, game.ruleset, game.seed
    ));
    lines.push(format!(
        "\n{:<4} {:<20} {:>5} {:>5} {:>5} {:>8}  {:<15} {} {:>6} {:>6}  {:>23}",
        "side",
        "agent",
        "score",
        "goals",
        "fouls",
        "penalty",
        "tier",
        violation_headings(),
        "late",
        "faults",
        "time mean/p99/max [ms]"
    ));
    for (number, side) in (1..).zip(&game.sides) {
        lines.push(format!(
            "{number:<4} {:<20} {:>5} {:>5} {:>5} {:>8.1}  {:<15} {} {:>6} {:>6}  {:>23}",
            side.agent,
            side.score,
            side.goals,
            side.fouls,
            side.penalty_points,
            side.tier.title(),
            violation_cells(&side.violations),
            side.late_answers,
            side.faults,
            computation_time_cell(side.computation_time_s),
        ));
    }
    for (number, side) in (1..).zip(&game.sides) {
        if let Some(cause) = &side.forfeit {
            lines.push(format!("\nside {number} forfeited: {cause}"));
        }
    }
    let (steps, windows, rallies) = (game.steps, game.windows, game.rallies);
    let played = format!("{steps} control steps, {windows} windows, {rallies} rallies");
    let result = game.result();
    match result.winner() {
        Some(side) => lines.push(format!(
            "\nwinner: side {}, {} ({result}); {played}",
            side as u32 + 1,
            game.sides[side as usize].agent
        )),
        None => lines.push(format!("\na draw ({result}); {played}")),
    }
    lines.join("\n") + "\n"
}

/// The end of an agent's log.
pub(super) fn log_tail(side: Side, log: &str) -> String {
    const MAX_LINES: usize = 10;
    let lines: Vec<&str> = log.lines().collect();
    let mut out = format!("the end of the log of side {}:\n", side.number());
    for line in &lines[lines.len().saturating_sub(MAX_LINES)..] {
        out.push_str("  ");
        out.push_str(line);
        out.push('\n');
    }
    out
}

/// Title and column headings of a series.
pub(super) fn series_head([first, second]: [&str; 2], kind: SeriesKind) -> String {
    let columns = match kind {
        SeriesKind::MirroredPairs => {
            let [home, away] = ["at home", "away"];
            format!("{:>5}  {home:<15} {away:<15} {:>10}", "pair", "difference")
        }
        SeriesKind::Games => format!("{:>5}  {:<15} {:>10}", "game", "goals", "difference"),
    };
    format!("{first} against {second}; goals, and the result of {first}\n{columns}")
}

/// A pair or a game as one line.
pub(super) fn series_line(number: u32, games: &[SeriesGame]) -> String {
    let mut line = format!("{number:>5} ");
    for game in games {
        let [first, second] = game.goals;
        let outcome = match game.winner {
            Some(0) => "won",
            Some(_) => "lost",
            None => "drew",
        };
        let cell = format!("{first} : {second} {outcome}");
        write!(line, " {cell:<15}").expect("writing to memory cannot fail");
    }
    let difference: i64 = games.iter().map(SeriesGame::difference).sum();
    line + &format!(" {difference:>+10}")
}

/// Summary of a series as text.
pub(super) fn series_table(results: &SeriesResults) -> String {
    let [first, second] = &results.agents;
    let [won, lost] = results.wins;
    let (singular, plural) = match results.series {
        SeriesKind::MirroredPairs => ("pair", "mirrored pairs"),
        SeriesKind::Games => ("game", "games"),
    };
    let difference = &results.goal_difference;
    let interval_text = |interval: Option<[f64; 2]>| match interval {
        Some([low, high]) => format!(" (95 %: {low:.2} to {high:.2})"),
        None => String::new(),
    };
    let mut out = format!(
        "\n{first} against {second}: {} {plural} of {} control steps, {} ({}), seed {}\n\
         {first} won {won} games, drew {}, lost {lost}\n\
         goals of {first} minus those of {second}, per {singular}: mean {:+.2}{}",
        difference.count,
        results.steps,
        results.profile,
        results.ruleset,
        results.seed,
        results.draws,
        difference.mean,
        interval_text(difference.mean_ci95),
    );
    if let Some(variance) = difference.variance {
        out.push_str(&format!(", variance {variance:.2}"));
    }
    out.push('\n');
    if let Some(spread) = &results.spread {
        out.push_str(&format!(
            "the variance of two independent games would be {:.2}",
            spread.of_independent_games
        ));
        if let Some(ratio) = spread.ratio {
            out.push_str(&format!(
                "; that of a pair is {ratio:.2} times as large{}",
                interval_text(spread.ratio_ci95)
            ));
        }
        out.push('\n');
    }
    out
}

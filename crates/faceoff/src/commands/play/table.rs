use super::series_results::{Kind, SeriesGame, SeriesResults};
use faceoff_scoring::tournament::GameScore;
use faceoff_types::Side;
use std::fmt::Write as _;

/// The result as a table for a terminal.
pub(super) fn of(game: &GameScore) -> String {
    let mut out = String::new();
    let mut line = |args: std::fmt::Arguments<'_>| {
        out.write_fmt(args).expect("writing to memory cannot fail");
        out.push('\n');
    };
    let [first, second] = &game.sides;
    line(format_args!(
        "{} against {}: {} ({}), seed {}",
        first.agent, second.agent, game.profile, game.ruleset, game.seed
    ));
    line(format_args!(
        "\n{:<4} {:<20} {:>5} {:>5} {:>5} {:>8}  {:<15} {:>4} {:>4} {:>4} {:>4} {:>4} {:>6} {:>6}  {:>23}",
        "side",
        "agent",
        "score",
        "goals",
        "fouls",
        "penalty",
        "tier",
        "ee",
        "link",
        "pos",
        "vel",
        "time",
        "late",
        "faults",
        "time mean/p99/max [ms]"
    ));
    for (number, side) in (1..).zip(&game.sides) {
        let (v, t) = (side.violations, side.computation_time_s);
        line(format_args!(
            "{number:<4} {:<20} {:>5} {:>5} {:>5} {:>8.1}  {:<15} {:>4} {:>4} {:>4} {:>4} {:>4} {:>6} {:>6}  {:>23}",
            side.agent,
            side.score,
            side.goals,
            side.fouls,
            side.penalty_points,
            side.tier.title(),
            v.ee,
            v.link,
            v.joint_pos,
            v.joint_vel,
            v.computation_time,
            side.late_answers,
            side.faults,
            format!(
                "{:.2} / {:.2} / {:.2}",
                1e3 * t.mean,
                1e3 * t.p99,
                1e3 * t.max
            ),
        ));
    }
    for (number, side) in (1..).zip(&game.sides) {
        if let Some(cause) = &side.forfeit {
            line(format_args!("\nside {number} forfeited: {cause}"));
        }
    }
    let (steps, windows, rallies) = (game.steps, game.windows, game.rallies);
    let played = format!("{steps} control steps, {windows} windows, {rallies} rallies");
    let result = game.result();
    match result.winner() {
        Some(side) => line(format_args!(
            "\nwinner: side {}, {} ({result}); {played}",
            side as u32 + 1,
            game.sides[side as usize].agent
        )),
        None => line(format_args!("\na draw ({result}); {played}")),
    }
    out
}

/// The end of an agent's log.
pub(super) fn log_tail(side: Side, log: &str) -> String {
    const LINES: usize = 10;
    let lines: Vec<&str> = log.lines().collect();
    let mut out = format!("the end of the log of side {}:\n", side.number());
    for line in &lines[lines.len().saturating_sub(LINES)..] {
        out.push_str("  ");
        out.push_str(line);
        out.push('\n');
    }
    out
}

/// What stands above the lines of a series.
pub(super) fn series_head([first, second]: [&str; 2], kind: Kind) -> String {
    let columns = match kind {
        Kind::MirroredPairs => {
            let [home, away] = ["at home", "away"];
            format!("{:>5}  {home:<15} {away:<15} {:>10}", "pair", "difference")
        }
        Kind::Games => format!("{:>5}  {:<15} {:>10}", "game", "goals", "difference"),
    };
    format!("{first} against {second}; goals, and what the first of them did\n{columns}")
}

/// A pair, or a game.
pub(super) fn series_line(number: u32, games: &[SeriesGame]) -> String {
    let mut line = format!("{number:>5} ");
    for game in games {
        let [first, second] = game.goals;
        let did = match game.winner {
            Some(0) => "won",
            Some(_) => "lost",
            None => "drew",
        };
        let told = format!("{first} : {second} {did}");
        write!(line, " {told:<15}").expect("writing to memory cannot fail");
    }
    let difference: i64 = games.iter().map(SeriesGame::difference).sum();
    line + &format!(" {difference:>+10}")
}

/// What a series came to.
pub(super) fn series(told: &SeriesResults) -> String {
    let [first, second] = &told.agents;
    let [won, lost] = told.wins;
    let (unit, units) = match told.series {
        Kind::MirroredPairs => ("pair", "mirrored pairs"),
        Kind::Games => ("game", "games"),
    };
    let difference = &told.goal_difference;
    let from_to = |interval: Option<[f64; 2]>| match interval {
        Some([low, high]) => format!(" (95 %: {low:.2} to {high:.2})"),
        None => String::new(),
    };
    let mut out = format!(
        "\n{first} against {second}: {} {units} of {} control steps, {} ({}), seed {}\n\
         {first} won {won} games, drew {}, lost {lost}\n\
         goals of {first} less those of {second}, by {unit}: mean {:+.2}{}",
        difference.of,
        told.steps,
        told.profile,
        told.ruleset,
        told.seed,
        told.draws,
        difference.mean,
        from_to(difference.mean_ci95),
    );
    if let Some(variance) = difference.variance {
        out.push_str(&format!(", variance {variance:.2}"));
    }
    out.push('\n');
    if let Some(spread) = &told.spread {
        out.push_str(&format!(
            "of two games that know nothing of each other the variance would be {:.2}",
            spread.of_independent_games
        ));
        if let Some(ratio) = spread.ratio {
            out.push_str(&format!(
                "; a pair's is {ratio:.2} times that{}",
                from_to(spread.ratio_ci95)
            ));
        }
        out.push('\n');
    }
    out
}

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

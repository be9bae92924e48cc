//! Text of a board: rows by *tier*, the class of an agent by its penalty points, with the columns of the qualifying table in the
//! paper of the Robot Air Hockey Challenge 2023.

use crate::commands::output::time_text;
use faceoff_api::views::board::{BoardRow, BoardView};
use faceoff_types::{Task, Tier};
use std::fmt::Write as _;

/// Width of the table in characters.
const WIDTH: usize = 78;

/// The board with its title, notices, baselines and disqualified teams.
pub(super) fn board_text(board: &BoardView) -> String {
    let mut text = format!("{}, {}", board.stage_name, board.ruleset);
    if let Some(task) = board.task {
        let _ = write!(text, ", {task}");
    }
    if let Some(division) = &board.division {
        let _ = write!(text, ", {division}");
    }
    if board.provisional {
        text.push_str(", provisional");
    }
    if let Some(frozen) = &board.frozen {
        let frozen_at = time_text(frozen.at);
        let _ = write!(text, "\nfrozen since {frozen_at}: {}", frozen.reason);
    }
    text.push('\n');
    match (board.rows.is_empty(), board.blind) {
        (true, true) => text.push_str(
            "\nthe stage is blind: results are hidden until the organisers reveal them\n",
        ),
        (true, false) => text.push_str("\nno results yet\n"),
        (false, _) => {
            let _ = write!(text, "\n{}", board_table(board));
        }
    }
    for row in &board.baselines {
        let _ = writeln!(
            text,
            "baseline: {}, {}, score {:.1}, {:.2} penalty points, would be rank {}",
            row.team, row.tier, row.score, row.penalty_points, row.would_rank
        );
    }
    for team in &board.disqualified {
        let reason = team
            .disqualified
            .as_ref()
            .map_or("", |ruling| &ruling.reason);
        let _ = writeln!(text, "disqualified: {}: {reason}", team.name);
    }
    text.trim_end().to_owned()
}

/// The ranked rows; tiers without teams are left out.
pub fn board_table(board: &BoardView) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "{:<4} {:<24} {:>8} {:>8} {:>8} {:>12} {:>7}",
        "rank", "team", "hit", "defend", "prepare", "penalty pts", "score"
    );
    for tier in Tier::ALL {
        let rows: Vec<_> = board.rows.iter().filter(|row| row.tier == tier).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = writeln!(text, "{:─<WIDTH$}", format!("── {} ", tier.title()));
        for row in rows {
            let _ = writeln!(text, "{}", row_line(row));
        }
    }
    text
}

fn row_line(row: &BoardRow) -> String {
    let rate = |task| match row.tasks.get(&task) {
        Some(result) => format!("{:.1}%", 100.0 * result.success_rate),
        None => "–".to_owned(),
    };
    format!(
        "{:<4} {:<24} {:>8} {:>8} {:>8} {:>12.1} {:>7.1}",
        row.rank,
        row.team,
        rate(Task::Hit),
        rate(Task::Defend),
        rate(Task::Prepare),
        row.penalty_points,
        row.score
    )
}

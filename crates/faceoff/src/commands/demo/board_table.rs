//! The board as text, in tiers, with the columns of the paper's qualifying table.

use faceoff_http::views::board::{BoardRow, BoardView};
use faceoff_types::{Task, Tier};
use std::fmt::Write as _;

/// Width of the table in characters.
const WIDTH: usize = 78;

/// The board as a table; a tier without teams is left out.
pub fn render(board: &BoardView) -> String {
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
            let _ = writeln!(text, "{}", line(row));
        }
    }
    text
}

fn line(row: &BoardRow) -> String {
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

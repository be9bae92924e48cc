//! Text of a board: rows by *tier*, the class of an agent by its penalty points, with the columns of the qualifying table in the
//! paper of the Robot Air Hockey Challenge 2023.

use crate::commands::output::time_text;
use crate::competition::competition;
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
        let tier = row
            .tier
            .map_or_else(String::new, |tier| format!(" {tier},"));
        let _ = writeln!(
            text,
            "baseline: {},{tier} score {:.1}, {:.2} penalty points, would be rank {}",
            row.team, row.score, row.penalty_points, row.hypothetical_rank
        );
    }
    for team in &board.disqualified {
        let reason = team
            .disqualified
            .as_ref()
            .map_or("", |decision| &decision.reason);
        let _ = writeln!(text, "disqualified: {}: {reason}", team.name);
    }
    text.trim_end().to_owned()
}

/// The ranked rows below headings of their tiers. Tiers without teams are left out; in a competition without tiers, there are no headings.
pub fn board_table(board: &BoardView) -> String {
    let tasks: Vec<Task> = competition().task_names().collect();
    let mut text = line(
        ["rank", "team"],
        tasks.iter().map(Task::to_string),
        ["penalty pts", "score"],
    );
    let tiers = [None].into_iter().chain(Tier::ALL.map(Some));
    for tier in tiers {
        let rows: Vec<_> = board.rows.iter().filter(|row| row.tier == tier).collect();
        if rows.is_empty() {
            continue;
        }
        if let Some(tier) = tier {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{:─<WIDTH$}", format!("── {} ", tier.title()));
        }
        for row in rows {
            text.push_str(&row_line(row, &tasks));
        }
    }
    text
}

fn row_line(row: &BoardRow, tasks: &[Task]) -> String {
    let rate = |task: &Task| match row.tasks.get(task) {
        Some(result) => format!("{:.1}%", 100.0 * result.success_rate),
        None => "–".to_owned(),
    };
    line(
        [&row.rank.to_string(), row.team.as_str()],
        tasks.iter().map(rate),
        [
            &format!("{:.1}", row.penalty_points),
            &format!("{:.1}", row.score),
        ],
    )
}

/// A line of the table, with one column per task.
fn line(
    [rank, team]: [&str; 2],
    tasks: impl Iterator<Item = String>,
    [penalty_points, score]: [&str; 2],
) -> String {
    let tasks: String = tasks.map(|text| format!(" {text:>8}")).collect();
    format!("{rank:<4} {team:<24}{tasks} {penalty_points:>12} {score:>7}\n")
}

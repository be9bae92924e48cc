//! Tables for spreadsheets.

use crate::views::{
    board::{BoardRow, BoardView},
    evaluation::{EvaluationStatus, EvaluationView},
    task::TaskView,
};
use faceoff_types::Task;
use std::collections::BTreeMap;

/// Lines of fields; quoted where they must be.
pub(super) struct Table(String);

impl Table {
    pub(super) fn new(columns: &[&str]) -> Self {
        let mut table = Self(String::new());
        table.row(columns.iter().map(|column| (*column).to_owned()));
        table
    }

    pub(super) fn row(&mut self, fields: impl IntoIterator<Item = String>) {
        for (number, field) in fields.into_iter().enumerate() {
            if number > 0 {
                self.0.push(',');
            }
            if field.contains([',', '"', '\n', '\r']) {
                self.0.push('"');
                self.0.push_str(&field.replace('"', "\"\""));
                self.0.push('"');
            } else {
                self.0.push_str(&field);
            }
        }
        self.0.push_str("\r\n");
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}

/// A stranger's words: what a spreadsheet would take for a formula begins with an apostrophe.
pub(super) fn words(text: &str) -> String {
    match text.chars().next() {
        Some('=' | '+' | '-' | '@' | '\t' | '\r') => format!("'{text}"),
        _ => text.to_owned(),
    }
}

fn or_empty(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

const OF_TASK: [&str; 7] = [
    "episodes",
    "successes",
    "success_rate",
    "ci95_low",
    "ci95_high",
    "penalty_points",
    "tier",
];

/// The columns of all tasks, whether a row has them or not.
fn with_tasks(columns: &[&str]) -> Vec<String> {
    let mut all: Vec<String> = columns.iter().map(|column| (*column).to_owned()).collect();
    for task in Task::ALL {
        all.extend(OF_TASK.map(|column| format!("{task}_{column}")));
    }
    all
}

fn of_tasks(tasks: Option<&BTreeMap<Task, TaskView>>) -> impl Iterator<Item = String> + '_ {
    Task::ALL
        .into_iter()
        .flat_map(move |task| match tasks.and_then(|tasks| tasks.get(&task)) {
            None => vec![String::new(); OF_TASK.len()],
            Some(result) => vec![
                result.episodes.to_string(),
                result.successes.to_string(),
                result.success_rate.to_string(),
                result.success_ci95[0].to_string(),
                result.success_ci95[1].to_string(),
                result.penalty_points.to_string(),
                result.tier.to_string(),
            ],
        })
}

/// A board, row by row.
pub(super) fn board(board: &BoardView) -> Vec<u8> {
    let columns = with_tasks(&[
        "rank",
        "rank_group",
        "tier",
        "tier_change_probability",
        "team",
        "team_id",
        "agent",
        "score",
        "penalty_points",
        "day",
        "evaluation",
        "finished_at",
    ]);
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    let mut table = Table::new(&names);
    for row in &board.rows {
        table.row(of_row(row).into_iter().chain(of_tasks(Some(&row.tasks))));
    }
    table.into_bytes()
}

fn of_row(row: &BoardRow) -> [String; 12] {
    [
        row.rank.to_string(),
        row.rank_group.to_string(),
        row.tier.to_string(),
        or_empty(row.tier_change_probability),
        words(row.team.as_str()),
        row.team_id.to_string(),
        words(row.agent.as_deref().unwrap_or_default()),
        row.score.to_string(),
        row.penalty_points.to_string(),
        row.day.to_string(),
        row.evaluation.to_string(),
        row.finished_at.to_string(),
    ]
}

/// A day, evaluation by evaluation.
pub(super) fn day(evaluations: &[EvaluationView]) -> Vec<u8> {
    let columns = with_tasks(&[
        "evaluation",
        "team",
        "team_id",
        "state",
        "voided",
        "extra_turn",
        "finished_at",
        "score",
        "penalty_points",
        "tier",
        "dataset_blake3",
    ]);
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    let mut table = Table::new(&names);
    for evaluation in evaluations {
        let (state, finished_at) = match &evaluation.status {
            EvaluationStatus::Queued => ("queued", None),
            EvaluationStatus::Running => ("running", None),
            EvaluationStatus::Finalising => ("finalising", None),
            EvaluationStatus::Finished { finished_at, .. } => ("finished", Some(finished_at)),
            EvaluationStatus::AgentFailed { finished_at, .. } => {
                ("agent_failed", Some(finished_at))
            }
            EvaluationStatus::PlatformFailed { finished_at, .. } => {
                ("platform_failed", Some(finished_at))
            }
            EvaluationStatus::NotPlayed { finished_at, .. } => ("not_played", Some(finished_at)),
            EvaluationStatus::Cancelled { finished_at, .. } => ("cancelled", Some(finished_at)),
        };
        let (result, hash) = match &evaluation.status {
            EvaluationStatus::Finished {
                result,
                dataset_blake3,
                ..
            } => (result.as_deref(), dataset_blake3.clone()),
            _ => (None, None),
        };
        let fields = [
            evaluation.id.to_string(),
            words(evaluation.team_name.as_str()),
            evaluation.team.to_string(),
            state.to_owned(),
            words(
                evaluation
                    .voided
                    .as_ref()
                    .map_or("", |ruling| ruling.reason.as_str()),
            ),
            words(evaluation.extra_turn.as_deref().unwrap_or_default()),
            or_empty(finished_at),
            or_empty(result.map(|result| result.score)),
            or_empty(result.map(|result| result.penalty_points)),
            or_empty(result.map(|result| result.tier)),
            hash.unwrap_or_default(),
        ];
        table.row(
            fields
                .into_iter()
                .chain(of_tasks(result.map(|result| &result.tasks))),
        );
    }
    table.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_and_formulas_are_words() {
        let mut table = Table::new(&["a", "b"]);
        table.row([words("=1+1"), "x, \"y\"\nz".to_owned()]);
        let text = String::from_utf8(table.into_bytes()).unwrap();
        assert_eq!(text, "a,b\r\n'=1+1,\"x, \"\"y\"\"\nz\"\r\n");
        assert_eq!(words("plain"), "plain");
    }
}

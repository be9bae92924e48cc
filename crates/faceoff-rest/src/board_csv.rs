//! Boards (the rankings of a stage) and their history as CSV: one line per team, with its results in all tasks.

use faceoff_api::views::{board::BoardView, history::HistoryView, task::TaskView};
use faceoff_service::csv::{Table, escape_formula, or_empty};
use faceoff_types::{Competition, TaskMap};
use std::fmt::Display;

/// The columns of each task about its score; a table prefixes them with the task's name. In a competition without tiers, tables have no
/// columns of them.
pub(crate) fn score_columns(competition: &Competition) -> Vec<&'static str> {
    let mut columns = vec![
        "episodes",
        "successes",
        "success_rate",
        "ci95_low",
        "ci95_high",
        "penalty_points",
    ];
    columns.extend(competition.tiers.map(|_| "tier"));
    columns
}

/// All columns of each task.
pub(crate) fn task_columns(competition: &Competition) -> Vec<String> {
    let violations = competition.violations.iter();
    let score = score_columns(competition).into_iter().chain(["steps"]);
    let times = [
        "computation_time_mean_s",
        "computation_time_p99_s",
        "computation_time_max_s",
    ];
    let mut columns: Vec<String> = score.map(str::to_owned).collect();
    columns.extend(violations.map(|info| format!("violations_{}", info.name)));
    columns.extend(times.map(str::to_owned));
    columns
}

/// An empty table with `columns`, followed by the `task_columns` of each task.
pub(crate) fn table_with_tasks(
    competition: &Competition,
    columns: &[&str],
    task_columns: &[impl Display],
) -> Table {
    let mut names: Vec<String> = columns.iter().map(|column| (*column).to_owned()).collect();
    for task in competition.task_names() {
        names.extend(task_columns.iter().map(|column| format!("{task}_{column}")));
    }
    Table::new(&names)
}

/// The values of the first `columns` of [`task_columns`] for each task; empty for tasks without a result.
pub(crate) fn task_fields<'a>(
    competition: &'a Competition,
    tasks: &'a TaskMap<TaskView>,
    columns: usize,
) -> impl Iterator<Item = String> + 'a {
    let count = task_columns(competition).len();
    let fields = move |task| match tasks.get(&task) {
        None => vec![String::new(); count],
        Some(result) => {
            let time = result.computation_time_s;
            let mut fields = vec![
                result.episodes.to_string(),
                result.successes.to_string(),
                result.success_rate.to_string(),
                result.success_ci95[0].to_string(),
                result.success_ci95[1].to_string(),
                result.penalty_points.to_string(),
            ];
            fields.extend(tier_fields(competition, [or_empty(result.tier)]));
            fields.push(or_empty(result.steps));
            let counts = result.violations.as_ref();
            let violations = competition.violations.iter();
            fields.extend(
                violations.map(|info| or_empty(counts.map(|counts| counts.get(info.name)))),
            );
            fields.extend([
                or_empty(time.map(|summary| summary.mean)),
                or_empty(time.map(|summary| summary.p99)),
                or_empty(time.map(|summary| summary.max)),
            ]);
            fields
        }
    };
    let first_fields = move |task| fields(task).into_iter().take(columns);
    competition.task_names().flat_map(first_fields)
}

/// The fields or headings of the columns about tiers; none in a competition without tiers.
pub(crate) fn tier_fields<T, const N: usize>(
    competition: &Competition,
    fields: [T; N],
) -> impl Iterator<Item = T> {
    competition.tiers.map(|_| fields).into_iter().flatten()
}

/// The fields that ranked rows and baselines (unranked agents of the organisers) have in common, from the column `tier` on.
macro_rules! common_fields {
    ($competition:expr, $row:expr, $division:expr) => {{
        let row = $row;
        let tier = [or_empty(row.tier), or_empty(row.tier_change_probability)];
        tier_fields($competition, tier)
            .chain([
                escape_formula(row.team.as_str()),
                row.team_id.to_string(),
                escape_formula(row.agent.as_deref().unwrap_or_default()),
                row.score.to_string(),
                row.penalty_points.to_string(),
                row.day.to_string(),
                row.evaluation.to_string(),
                row.finished_at.to_string(),
                escape_formula($division),
                row.evaluations.len().to_string(),
                escape_formula(row.extra_evaluation.as_deref().unwrap_or_default()),
                or_empty(row.released_at),
                row.ruleset.clone(),
                row.profile.to_string(),
                or_empty(row.seed),
            ])
            .chain(task_fields($competition, &row.tasks, usize::MAX))
    }};
}

/// The ranked rows, then the baselines, whose column `would_rank` has the rank that they would have.
pub(crate) fn board_table(competition: &Competition, board: &BoardView) -> Table {
    let mut columns = vec!["rank", "rank_group", "baseline", "would_rank"];
    columns.extend(tier_fields(
        competition,
        ["tier", "tier_change_probability"],
    ));
    columns.extend([
        "team",
        "team_id",
        "agent",
        "score",
        "penalty_points",
        "day",
        "evaluation",
        "finished_at",
        "division",
        "days",
        // The reason for an extra evaluation, under the name that readers of older versions know.
        "extra_turn",
        "released_at",
        "ruleset",
        "profile",
        "seed",
    ]);
    let mut table = table_with_tasks(competition, &columns, &task_columns(competition));
    for row in &board.rows {
        let division = row.division.as_ref().map_or("", |name| name.as_str());
        let rank_fields = [
            row.rank.to_string(),
            row.rank_group.to_string(),
            "false".to_owned(),
            String::new(),
        ];
        table.row(
            rank_fields
                .into_iter()
                .chain(common_fields!(competition, row, division)),
        );
    }
    for row in &board.baselines {
        let rank_fields = [
            String::new(),
            String::new(),
            "true".to_owned(),
            row.hypothetical_rank.to_string(),
        ];
        table.row(
            rank_fields
                .into_iter()
                .chain(common_fields!(competition, row, "")),
        );
    }
    table
}

/// One line per team and day.
pub(crate) fn history_table(competition: &Competition, history: &HistoryView) -> Table {
    let mut columns = vec![
        "day",
        "team",
        "team_id",
        "division",
        "baseline",
        "rank",
        "would_rank",
    ];
    columns.extend(tier_fields(competition, ["tier"]));
    columns.extend([
        "score",
        "penalty_points",
        "evaluation",
        "finished_at",
        "released_at",
    ]);
    let mut table = table_with_tasks(competition, &columns, &task_columns(competition));
    for row in &history.rows {
        let fields = [
            row.day.to_string(),
            escape_formula(row.team.as_str()),
            row.team_id.to_string(),
            escape_formula(row.division.as_ref().map_or("", |name| name.as_str())),
            row.baseline.to_string(),
            or_empty(row.rank),
            or_empty(row.hypothetical_rank),
        ];
        let result_fields = [
            row.score.to_string(),
            row.penalty_points.to_string(),
            row.evaluation.to_string(),
            row.finished_at.to_string(),
            or_empty(row.released_at),
        ];
        let task_fields = task_fields(competition, &row.tasks, usize::MAX);
        table.row(
            fields
                .into_iter()
                .chain(tier_fields(competition, [or_empty(row.tier)]))
                .chain(result_fields)
                .chain(task_fields),
        );
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_service::csv::CsvFormat;
    use serde_json::json;

    /// Headings and fields of a table's only row.
    fn columns(table: Table) -> Vec<(String, String)> {
        let text = String::from_utf8(table.into_bytes(CsvFormat::Csv)).unwrap();
        let lines: Vec<Vec<String>> = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect();
        let [heads, fields] = &lines[..] else {
            panic!("not two lines: {text}");
        };
        assert_eq!(heads.len(), fields.len(), "{text}");
        heads.iter().cloned().zip(fields.iter().cloned()).collect()
    }

    #[test]
    fn tables_without_tiers_lack_only_the_tier_columns() {
        let competition = faceoff_airhockey::competition();
        let without = Competition {
            tiers: None,
            ..competition.clone()
        };
        let id = "00000000-0000-0000-0000-000000000001";
        let row = json!({
            "day": "2026-03-01", "team": "A", "team_id": id, "baseline": false, "rank": 1, "rank_group": 1, "agent": null,
            "evaluation": id, "evaluations": [id], "finished_at": "2026-03-01T06:30:00Z", "ruleset": "a", "profile": "evaluation",
            "released_at": null, "seed": null, "score": 20.0, "penalty_points": 3.0, "tier": "deployable",
            "tier_change_probability": 0.25, "tasks": {"hit": {
                "episodes": 10, "successes": 5, "success_rate": 0.5, "success_ci95": [0.2, 0.8], "penalty_points": 3.0,
                "tier": "deployable",
            }},
        });
        let history = json!({
            "stage": id, "stage_name": "A stage", "revision": 1, "standings": "latest", "blind": false, "provisional": true,
            "task": null, "days": ["2026-03-01"], "rows": [&row],
        });
        let board = json!({
            "stage": id, "stage_name": "A stage", "revision": 1, "since": "2026-03-01T00:00:00Z", "ruleset": "a",
            "weights": {"hit": 1.0}, "standings": "latest", "rows_by": "latest", "blind": false, "provisional": true,
            "finalised": null, "task": null, "significance": 0.05, "tier_change_resamples": 2000, "disqualified": [],
            "rows": [&row],
        });
        let history: HistoryView = serde_json::from_value(history).unwrap();
        let board: BoardView = serde_json::from_value(board).unwrap();
        for table in [
            |competition: &Competition, _: &BoardView, history: &HistoryView| {
                history_table(competition, history)
            },
            |competition: &Competition, board: &BoardView, _: &HistoryView| {
                board_table(competition, board)
            },
        ] {
            let mut with_tiers = columns(table(&competition, &board, &history));
            let all = with_tiers.len();
            with_tiers.retain(|(head, _)| !head.contains("tier"));
            assert!(with_tiers.len() < all);
            assert_eq!(columns(table(&without, &board, &history)), with_tiers);
        }
    }
}

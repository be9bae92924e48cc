//! Boards (the rankings of a stage) and their history as CSV: one line per team, with its results in all tasks.

use faceoff_api::views::{board::BoardView, history::HistoryView, task::TaskView};
use faceoff_service::csv::{Table, escape_formula, or_empty};
use faceoff_types::{Competition, TaskMap};
use std::fmt::Display;

/// The columns of each task about its score; a table prefixes them with the task's name.
pub(crate) const SCORE_COLUMNS: [&str; 7] = [
    "episodes",
    "successes",
    "success_rate",
    "ci95_low",
    "ci95_high",
    "penalty_points",
    "tier",
];

/// All columns of each task.
pub(crate) fn task_columns(competition: &Competition) -> Vec<String> {
    let violations = competition.violations.iter();
    let score = SCORE_COLUMNS.into_iter().chain(["steps"]);
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
                result.tier.to_string(),
                or_empty(result.steps),
            ];
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

/// The fields that ranked rows and baselines (unranked agents of the organisers) have in common, from the column `tier` on.
macro_rules! common_fields {
    ($competition:expr, $row:expr, $division:expr) => {{
        let row = $row;
        [
            row.tier.to_string(),
            or_empty(row.tier_change_probability),
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
        ]
        .into_iter()
        .chain(task_fields($competition, &row.tasks, usize::MAX))
    }};
}

/// The ranked rows, then the baselines.
pub(crate) fn board_table(competition: &Competition, board: &BoardView) -> Vec<u8> {
    let mut table = table_with_tasks(
        competition,
        &[
            "rank",
            "rank_group",
            "baseline",
            "would_rank",
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
            "division",
            "days",
            // The reason for an extra evaluation, under the name that readers of older versions know.
            "extra_turn",
            "released_at",
            "ruleset",
            "profile",
            "seed",
        ],
        &task_columns(competition),
    );
    for row in &board.rows {
        let division = row.division.as_ref().map_or("", |name| name.as_str());
        let rank = [
            row.rank.to_string(),
            row.rank_group.to_string(),
            "false".to_owned(),
            String::new(),
        ];
        table.row(
            rank.into_iter()
                .chain(common_fields!(competition, row, division)),
        );
    }
    for row in &board.baselines {
        let rank = [
            String::new(),
            String::new(),
            "true".to_owned(),
            row.would_rank.to_string(),
        ];
        table.row(rank.into_iter().chain(common_fields!(competition, row, "")));
    }
    table.into_bytes()
}

/// One line per team and day.
pub(crate) fn history_table(competition: &Competition, history: &HistoryView) -> Vec<u8> {
    let mut table = table_with_tasks(
        competition,
        &[
            "day",
            "team",
            "team_id",
            "division",
            "baseline",
            "rank",
            "would_rank",
            "tier",
            "score",
            "penalty_points",
            "evaluation",
            "finished_at",
            "released_at",
        ],
        &task_columns(competition),
    );
    for row in &history.rows {
        let fields = [
            row.day.to_string(),
            escape_formula(row.team.as_str()),
            row.team_id.to_string(),
            escape_formula(row.division.as_ref().map_or("", |name| name.as_str())),
            row.baseline.to_string(),
            or_empty(row.rank),
            or_empty(row.would_rank),
            row.tier.to_string(),
            row.score.to_string(),
            row.penalty_points.to_string(),
            row.evaluation.to_string(),
            row.finished_at.to_string(),
            or_empty(row.released_at),
        ];
        let task_fields = task_fields(competition, &row.tasks, usize::MAX);
        table.row(fields.into_iter().chain(task_fields));
    }
    table.into_bytes()
}

//! Boards, and what teams have played, for spreadsheets: a line for each row, with everything that a row has by task.

use faceoff_api::views::{board::BoardView, history::HistoryView, task::TaskView};
use faceoff_service::csv::{Table, or_empty, words};
use faceoff_types::Task;
use std::collections::BTreeMap;

/// Columns of each task, whose name stands before them.
const OF_TASK: [&str; 16] = [
    "episodes",
    "successes",
    "success_rate",
    "ci95_low",
    "ci95_high",
    "penalty_points",
    "tier",
    "steps",
    "violations_ee",
    "violations_link",
    "violations_joint_pos",
    "violations_joint_vel",
    "violations_computation_time",
    "computation_time_mean_s",
    "computation_time_p99_s",
    "computation_time_max_s",
];

/// The columns of all tasks behind others, whether a row has them or not.
fn with_tasks(columns: &[&str]) -> Table {
    let mut all: Vec<String> = columns.iter().map(|column| (*column).to_owned()).collect();
    for task in Task::ALL {
        all.extend(OF_TASK.map(|column| format!("{task}_{column}")));
    }
    let names: Vec<&str> = all.iter().map(String::as_str).collect();
    Table::new(&names)
}

fn of_tasks(tasks: &BTreeMap<Task, TaskView>) -> impl Iterator<Item = String> + '_ {
    let of_task = |task| match tasks.get(&task) {
        None => vec![String::new(); OF_TASK.len()],
        Some(result) => {
            let violations = result.violations;
            let time = result.computation_time_s;
            vec![
                result.episodes.to_string(),
                result.successes.to_string(),
                result.success_rate.to_string(),
                result.success_ci95[0].to_string(),
                result.success_ci95[1].to_string(),
                result.penalty_points.to_string(),
                result.tier.to_string(),
                or_empty(result.steps),
                or_empty(violations.map(|of| of.ee)),
                or_empty(violations.map(|of| of.link)),
                or_empty(violations.map(|of| of.joint_pos)),
                or_empty(violations.map(|of| of.joint_vel)),
                or_empty(violations.map(|of| of.computation_time)),
                or_empty(time.map(|of| of.mean)),
                or_empty(time.map(|of| of.p99)),
                or_empty(time.map(|of| of.max)),
            ]
        }
    };
    Task::ALL.into_iter().flat_map(of_task)
}

/// What ranked rows and baselines have in common, whose fields have the same names.
macro_rules! in_common {
    ($row:expr, $division:expr) => {{
        let row = $row;
        [
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
            words($division),
            row.evaluations.len().to_string(),
            words(row.extra_turn.as_deref().unwrap_or_default()),
            or_empty(row.released_at),
            row.ruleset.clone(),
            row.profile.to_string(),
            or_empty(row.seed),
        ]
        .into_iter()
        .chain(of_tasks(&row.tasks))
    }};
}

/// The ranked rows, then the baselines.
pub(crate) fn of_board(board: &BoardView) -> Vec<u8> {
    let mut table = with_tasks(&[
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
        "extra_turn",
        "released_at",
        "ruleset",
        "profile",
        "seed",
    ]);
    for row in &board.rows {
        let division = row.division.as_ref().map_or("", |name| name.as_str());
        let place = [
            row.rank.to_string(),
            row.rank_group.to_string(),
            "false".to_owned(),
            String::new(),
        ];
        table.row(place.into_iter().chain(in_common!(row, division)));
    }
    for row in &board.baselines {
        let place = [
            String::new(),
            String::new(),
            "true".to_owned(),
            row.would_rank.to_string(),
        ];
        table.row(place.into_iter().chain(in_common!(row, "")));
    }
    table.into_bytes()
}

pub(crate) fn of_history(history: &HistoryView) -> Vec<u8> {
    let mut table = with_tasks(&[
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
    ]);
    for row in &history.rows {
        let fields = [
            row.day.to_string(),
            words(row.team.as_str()),
            row.team_id.to_string(),
            words(row.division.as_ref().map_or("", |name| name.as_str())),
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
        table.row(fields.into_iter().chain(of_tasks(&row.tasks)));
    }
    table.into_bytes()
}

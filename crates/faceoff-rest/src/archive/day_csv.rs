//! The evaluations of a day in the season archive, as CSV: one line per team, with its results in all tasks.

use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    task::TaskView,
};
use faceoff_service::csv::{Table, escape_formula, or_empty};
use faceoff_types::Task;
use std::collections::BTreeMap;

/// Columns of each task; the table prefixes them with the task's name.
const TASK_COLUMNS: [&str; 7] = [
    "episodes",
    "successes",
    "success_rate",
    "ci95_low",
    "ci95_high",
    "penalty_points",
    "tier",
];

/// `columns`, followed by [`TASK_COLUMNS`] of each task.
fn columns_with_tasks(columns: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = columns.iter().map(|column| (*column).to_owned()).collect();
    for task in Task::ALL {
        names.extend(TASK_COLUMNS.map(|column| format!("{task}_{column}")));
    }
    names
}

/// The values of [`TASK_COLUMNS`] for each task; empty for tasks without a result.
fn task_fields(tasks: Option<&BTreeMap<Task, TaskView>>) -> impl Iterator<Item = String> + '_ {
    Task::ALL
        .into_iter()
        .flat_map(move |task| match tasks.and_then(|tasks| tasks.get(&task)) {
            None => vec![String::new(); TASK_COLUMNS.len()],
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

/// A table with one line per evaluation.
pub(super) fn day_table(evaluations: &[EvaluationView]) -> Vec<u8> {
    let columns = columns_with_tasks(&[
        "evaluation",
        "team",
        "team_id",
        "state",
        "voided",
        // The reason for an extra evaluation, under the name that readers of older versions know.
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
            escape_formula(evaluation.team_name.as_str()),
            evaluation.team.to_string(),
            state.to_owned(),
            escape_formula(
                evaluation
                    .voided
                    .as_ref()
                    .map_or("", |ruling| ruling.reason.as_str()),
            ),
            escape_formula(evaluation.extra_evaluation.as_deref().unwrap_or_default()),
            or_empty(finished_at),
            or_empty(result.map(|result| result.score)),
            or_empty(result.map(|result| result.penalty_points)),
            or_empty(result.map(|result| result.tier)),
            hash.unwrap_or_default(),
        ];
        table.row(
            fields
                .into_iter()
                .chain(task_fields(result.map(|result| &result.tasks))),
        );
    }
    table.into_bytes()
}

//! The evaluations of a day in the season archive, as CSV: one line per team, with its results in all tasks.

use crate::board_csv::{score_columns, table_with_tasks, task_fields, tier_fields};
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView};
use faceoff_service::csv::{Table, escape_formula, or_empty};
use faceoff_types::Competition;

/// A table with one line per evaluation.
pub(super) fn day_table(competition: &Competition, evaluations: &[EvaluationView]) -> Table {
    let mut columns = vec![
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
    ];
    columns.extend(tier_fields(competition, ["tier"]));
    columns.push("dataset_blake3");
    let score_columns = score_columns(competition);
    let mut table = table_with_tasks(competition, &columns, &score_columns);
    let no_tasks = Default::default();
    for evaluation in evaluations {
        // States have their names in the API, some of which differ from those here.
        let (state, finished_at) = match &evaluation.status {
            EvaluationStatus::Queued => ("queued", None),
            EvaluationStatus::Running => ("running", None),
            EvaluationStatus::Scoring => ("finalising", None),
            EvaluationStatus::Finished { finished_at, .. } => ("finished", Some(finished_at)),
            EvaluationStatus::AgentFailed { finished_at, .. } => {
                ("agent_failed", Some(finished_at))
            }
            EvaluationStatus::PlatformFailed { finished_at, .. } => {
                ("platform_failed", Some(finished_at))
            }
            EvaluationStatus::DeadlineMissed { finished_at, .. } => {
                ("not_played", Some(finished_at))
            }
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
                    .map_or("", |decision| decision.reason.as_str()),
            ),
            escape_formula(evaluation.extra_evaluation.as_deref().unwrap_or_default()),
            or_empty(finished_at),
            or_empty(result.map(|result| result.score)),
            or_empty(result.map(|result| result.penalty_points)),
        ];
        let tier = or_empty(result.and_then(|result| result.tier));
        let tasks = result.map_or(&no_tasks, |result| &result.tasks);
        table.row(
            fields
                .into_iter()
                .chain(tier_fields(competition, [tier]))
                .chain([hash.unwrap_or_default()])
                .chain(task_fields(competition, tasks, score_columns.len())),
        );
    }
    table
}

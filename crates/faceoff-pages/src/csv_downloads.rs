//! Downloads in CSV: episodes and answer times of an evaluation, and ablations.

mod positions;

use super::frame::PageProblem;
use axum::{extract::State, response::Response};
use faceoff_api::views::ablation::AblationStatus;
use faceoff_replay::EpisodeIndexEntry;
use faceoff_service::{
    app::App,
    csv::{CsvQuery, Table, escape_formula, or_empty},
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{ablation, clips::Clips, visibility::Visibility},
};
use faceoff_types::{EvaluationId, SubmissionId, ViolationName};

type CsvResponse = Result<Response, PageProblem>;

/// `/evaluations/{id}/episodes.csv`: a line per episode.
pub(super) async fn episodes(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
    query: Result<QueryParams<CsvQuery>, Problem>,
) -> CsvResponse {
    let PathParam(id) = id?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let view = Clips::find(&app, &visibility, id).await?.episodes().await?;
    let mut columns: Vec<String> = ["task", "episode", "steps", "success", "end", "why"]
        .map(str::to_owned)
        .into();
    let has_positions =
        view.episodes.is_empty() || view.episodes.iter().any(EpisodeIndexEntry::has_clips);
    let mut suffixes = vec!["first_step", "steps", "worst"];
    if has_positions {
        columns.extend(positions::state_columns());
        suffixes.extend(positions::VIOLATION_SUFFIXES);
    }
    columns.extend(["longest_s", "late"].map(str::to_owned));
    let kinds: Vec<ViolationName> = app.config.competition().world_violations().collect();
    for name in &kinds {
        columns.extend(suffixes.iter().map(|suffix| format!("{name}_{suffix}")));
    }
    let mut table = Table::new(&columns);
    for summary in &view.episodes {
        let mut row = vec![
            summary.task.to_string(),
            summary.episode.to_string(),
            summary.steps.to_string(),
            summary.success.to_string(),
            summary.end.as_str().to_owned(),
            escape_formula(&summary.end_description),
        ];
        if has_positions {
            row.extend(positions::states(summary));
        }
        row.push(or_empty(summary.longest_s));
        row.push(or_empty(summary.longest_s.map(|_| summary.late_answers)));
        for name in &kinds {
            let violation = summary
                .violations
                .iter()
                .find(|violation| violation.constraint == *name);
            row.extend([
                or_empty(violation.map(|violation| violation.from)),
                or_empty(violation.map(|violation| violation.samples)),
                or_empty(violation.map(|violation| violation.max_excess)),
            ]);
            if has_positions {
                row.extend(positions::violation(violation));
            }
        }
        table.row(row);
    }
    Ok(table.into_download("episodes.csv", query?.0.format))
}

/// `/evaluations/{id}/answer-times.csv`: number of control steps by answer time, for those who may see the dataset.
pub(super) async fn answer_times(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
    query: Result<QueryParams<CsvQuery>, Problem>,
) -> CsvResponse {
    let PathParam(id) = id?;
    let viewer = viewer?;
    let visibility = Visibility::load(&app, viewer).await?;
    let clips = Clips::find(&app, &visibility, id).await?;
    if !clips.can_see_observations {
        let detail = "computation times are visible to the team only until the dataset is public";
        return Err(Problem::new(viewer.denial_kind(), detail).into());
    }
    let mut table = Table::new(&["task", "from_s", "to_s", "steps"]);
    for (task, bins) in clips.computation_times().await? {
        for bin in bins {
            table.row([
                task.to_string(),
                bin.from_s.to_string(),
                bin.to_s.to_string(),
                bin.steps.to_string(),
            ]);
        }
    }
    Ok(table.into_download("answer-times.csv", query?.0.format))
}

/// `/submissions/{id}/ablation.csv`: a line per task and profile.
pub(super) async fn ablation(
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    query: Result<QueryParams<CsvQuery>, Problem>,
) -> CsvResponse {
    let PathParam(id) = id?;
    let view = ablation::newest(&app, id).await?;
    let Some(AblationStatus::Finished { tasks, .. }) = view.map(|view| view.status) else {
        return Err(Problem::not_found("finished ablation").into());
    };
    let mut table = Table::new(&[
        "task",
        "profile",
        "episodes",
        "successes",
        "success_rate",
        "ci95_low",
        "ci95_high",
        "penalty_points",
        "difference",
        "lost",
        "gained",
        "p_value",
    ]);
    for (task, effects) in tasks {
        for effect in effects {
            table.row([
                task.to_string(),
                effect.profile.to_string(),
                effect.episodes.to_string(),
                effect.successes.to_string(),
                effect.success_rate.to_string(),
                effect.success_ci95[0].to_string(),
                effect.success_ci95[1].to_string(),
                effect.penalty_points.to_string(),
                effect.difference.to_string(),
                effect.lost.to_string(),
                effect.gained.to_string(),
                effect.p_value.to_string(),
            ]);
        }
    }
    Ok(table.into_download("ablation.csv", query?.0.format))
}

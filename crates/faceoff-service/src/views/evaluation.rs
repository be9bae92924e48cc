//! Evaluations, with progress and position in the queue. An *evaluation* is the run of all tasks of a day with one team's submission.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{decision, queue, visibility::Visibility},
};
use faceoff_api::{
    paths,
    views::{
        evaluation::{EvaluationStatus, EvaluationView, FaultView, Progress, ResultView},
        printable,
    },
};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Evaluation, EvaluationState};
use faceoff_types::{EvaluationId, StageDay, TeamId, TeamName};
use jiff::Timestamp;
use std::{collections::BTreeMap, sync::Arc};

/// Text of the field `next`, which says what happens next, for a finished evaluation whose dataset was removed.
const DATASET_REMOVED: &str = "Done. The result stays; the dataset was removed.";

/// An evaluation, with its faults if the viewer may see them.
#[boxed_future]
pub async fn find(
    app: &AppState,
    visibility: &Visibility,
    id: EvaluationId,
) -> Result<EvaluationView, Problem> {
    build(app, visibility, app.store.evaluation(id).await?).await
}

/// The evaluation as organisers see it.
#[boxed_future]
pub async fn for_organiser(
    app: &AppState,
    evaluation: Evaluation,
) -> Result<EvaluationView, Problem> {
    build(app, &Visibility::for_organiser(app).await?, evaluation).await
}

/// An evaluation with its position in the queue. If it failed by agent faults and its day is released, its team and the organisers
/// also see the faults and the log.
#[boxed_future]
pub async fn build(
    app: &AppState,
    visibility: &Visibility,
    evaluation: Evaluation,
) -> Result<EvaluationView, Problem> {
    let team = app.store.team(evaluation.team).await?;
    let run = evaluation.run;
    let shows_faults = visibility.has_team_access(&evaluation)
        && !visibility.hides_scores(evaluation.stage_day.stage);
    let mut view = evaluation_view(visibility, evaluation, team.name);
    if let EvaluationStatus::AgentFailed { faults, log, .. } = &mut view.status
        && view.released_at.is_some()
        && shows_faults
    {
        let run_faults = app.store.run_faults(run).await?;
        *faults = Some(run_faults.faults.into_iter().map(FaultView::from).collect());
        *log = Some(printable(run_faults.log));
    }
    add_queue_positions(app, std::slice::from_mut(&mut view)).await?;
    Ok(view)
}

/// Adds positions in the queue to unfinished evaluations. If all have ended, the database is not read.
#[boxed_future]
pub async fn add_queue_positions(
    app: &AppState,
    views: &mut [EvaluationView],
) -> Result<(), Problem> {
    if views.iter().all(|view| view.status.is_final()) {
        return Ok(());
    }
    let forecast = queue::forecast(app).await?;
    for view in views {
        view.queue = forecast.evaluations.get(&view.id).copied().map(queue::view);
    }
    Ok(())
}

/// The evaluations of a day.
#[boxed_future]
pub async fn day_evaluations(
    app: &AppState,
    visibility: &Visibility,
    stage_day: StageDay,
) -> Result<Vec<EvaluationView>, Problem> {
    all(
        app,
        visibility,
        app.store.evaluations_of_day(stage_day).await?,
    )
    .await
}

/// Unfinished evaluations of the day before, then those of `today`.
#[boxed_future]
pub async fn current(
    app: &AppState,
    visibility: &Visibility,
    today: StageDay,
) -> Result<Vec<EvaluationView>, Problem> {
    let mut evaluations = match today.date.yesterday() {
        Ok(date) => {
            let yesterday = StageDay { date, ..today };
            app.store.evaluations_of_day(yesterday).await?
        }
        Err(_) => Vec::new(),
    };
    evaluations.retain(|evaluation| !evaluation.state.is_over());
    evaluations.extend(app.store.evaluations_of_day(today).await?);
    all(app, visibility, evaluations).await
}

/// Views of these evaluations, in order; without faults and logs, which are long.
#[boxed_future]
pub async fn all(
    app: &AppState,
    visibility: &Visibility,
    evaluations: Vec<Evaluation>,
) -> Result<Vec<EvaluationView>, Problem> {
    let teams = app.store.teams().await?;
    let names: BTreeMap<TeamId, TeamName> =
        teams.into_iter().map(|team| (team.id, team.name)).collect();
    evaluations
        .into_iter()
        .map(|evaluation| match names.get(&evaluation.team) {
            Some(name) => Ok(evaluation_view(visibility, evaluation, name.clone())),
            None => Err(Problem::internal(format_args!(
                "evaluation {} has no team",
                evaluation.id
            ))),
        })
        .collect()
}

/// Was the day's seed already public when a rerun was requested? False for an extra evaluation (one with an
/// `extra_reason`), which has its own seed.
pub(super) fn used_public_episodes(
    created_at: Timestamp,
    released_at: Option<Timestamp>,
    extra_reason: Option<&str>,
) -> bool {
    extra_reason.is_none() && released_at.is_some_and(|released_at| created_at >= released_at)
}

/// An evaluation without its position in the queue, and without faults and log.
fn evaluation_view(
    visibility: &Visibility,
    evaluation: Evaluation,
    team_name: TeamName,
) -> EvaluationView {
    let is_released = evaluation.released_at.is_some();
    let has_dataset = evaluation.dataset_removed.is_none();
    // A blind stage hides scores and dataset from all but the organisers. Whether the evaluation is public, for visitors without a token,
    // is another question.
    let hides_scores = visibility.hides_scores(evaluation.stage_day.stage);
    let is_public = visibility.is_public(&evaluation);
    let episodes_total = evaluation.plan.episodes_total();
    let episodes_done = match &evaluation.state {
        EvaluationState::Running { progress, .. } => {
            visibility.episodes_done(progress).min(episodes_total)
        }
        EvaluationState::Scoring | EvaluationState::Finished { .. } => episodes_total,
        EvaluationState::Queued
        | EvaluationState::AgentFailed { .. }
        | EvaluationState::PlatformFailed { .. }
        | EvaluationState::DeadlineMissed { .. }
        | EvaluationState::Cancelled { .. } => 0,
    };
    let status = match evaluation.state {
        EvaluationState::Queued => EvaluationStatus::Queued,
        EvaluationState::Running { .. } => EvaluationStatus::Running,
        EvaluationState::Scoring => EvaluationStatus::Scoring,
        EvaluationState::Finished {
            finished_at,
            result,
            dataset_blake3,
            ..
        } => EvaluationStatus::Finished {
            finished_at,
            result: (!hides_scores).then(|| Box::new(ResultView::new(*result, is_released))),
            dataset: (!hides_scores && has_dataset)
                .then(|| format!("{}/dataset", paths::evaluation(evaluation.id))),
            dataset_blake3: dataset_blake3.filter(|_| !hides_scores),
        },
        EvaluationState::AgentFailed { finished_at } => EvaluationStatus::AgentFailed {
            finished_at,
            faults: None,
            log: None,
        },
        EvaluationState::PlatformFailed {
            finished_at,
            reason,
        } => EvaluationStatus::PlatformFailed {
            finished_at,
            reason: printable(reason),
        },
        EvaluationState::DeadlineMissed {
            finished_at,
            reason,
        } => EvaluationStatus::DeadlineMissed {
            finished_at,
            reason,
        },
        EvaluationState::Cancelled {
            finished_at,
            reason,
        } => EvaluationStatus::Cancelled {
            finished_at,
            reason,
        },
    };
    let is_voided = evaluation.voided.is_some();
    EvaluationView {
        id: evaluation.id,
        submission: evaluation.submission,
        team: evaluation.team,
        team_name,
        stage: evaluation.stage_day.stage,
        revision: evaluation.revision,
        day: evaluation.stage_day.date,
        released_at: evaluation.released_at,
        deadline_at: evaluation.deadline_at,
        rerun_of: evaluation.rerun_of,
        rerun_after_release: evaluation.rerun_of.is_some()
            && used_public_episodes(
                evaluation.created_at,
                evaluation.released_at,
                evaluation.extra_reason.as_deref(),
            ),
        extra_evaluation: evaluation.extra_reason,
        voided: evaluation.voided.map(decision::view),
        blind: hides_scores,
        public: is_public,
        dataset_removed: evaluation.dataset_removed.map(decision::view),
        profile: evaluation.plan.profile,
        tasks: evaluation.plan.tasks,
        episodes_per_task: evaluation.plan.episodes_per_task,
        created_at: evaluation.created_at,
        progress: Progress {
            episodes_done,
            episodes_total,
        },
        queue: None,
        next: match status.next(is_released, is_voided) {
            EvaluationStatus::DONE if !has_dataset => DATASET_REMOVED,
            next => next,
        }
        .to_owned(),
        status,
    }
}

/// Episode summary of a finished evaluation: solved episodes and certainty of its tiers.
#[boxed_future]
pub async fn summary(
    view: &EvaluationView,
    app: &AppState,
) -> Result<Arc<EpisodeSummary>, Problem> {
    let run = app.store.evaluation(view.id).await?.run;
    app.summaries.load_run(run).await
}

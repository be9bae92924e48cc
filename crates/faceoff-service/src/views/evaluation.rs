//! An evaluation on its way to a score or a failure.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{queue, ruling, sight::Sight},
};
use faceoff_api::{
    paths,
    views::{
        evaluation::{EvaluationStatus, EvaluationView, FaultView, Progress, ResultView},
        shown,
    },
};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Evaluation, EvaluationState};
use faceoff_types::{EvaluationId, StageDay, TeamId, TeamName};
use std::{collections::BTreeMap, sync::Arc};

/// What happens next to a finished evaluation of a released day without its dataset.
const DATASET_GONE: &str = "Nothing more: its result stays, its dataset was removed.";

/// One, with its faults where the viewer sees them.
#[boxed]
pub async fn find(
    app: &AppState,
    sight: &Sight,
    id: EvaluationId,
) -> Result<EvaluationView, Problem> {
    of(app, sight, app.store.evaluation(id).await?).await
}

/// With its place in the queue while it is under way; with faults and log, if it failed by them, its day is
/// released, and the viewer may see them.
#[boxed]
pub async fn of(
    app: &AppState,
    sight: &Sight,
    evaluation: Evaluation,
) -> Result<EvaluationView, Problem> {
    let team = app.store.team(evaluation.team).await?;
    let run = evaluation.run;
    let tells_faults = sight.is_own(&evaluation) && !sight.is_hidden(evaluation.of.stage);
    let mut view = view(sight, evaluation, team.name);
    if let EvaluationStatus::AgentFailed { faults, log, .. } = &mut view.status
        && view.released_at.is_some()
        && tells_faults
    {
        let of_run = app.store.run_faults(run).await?;
        *faults = Some(of_run.faults.into_iter().map(FaultView::from).collect());
        *log = Some(shown(of_run.log));
    }
    place(app, std::slice::from_mut(&mut view)).await?;
    Ok(view)
}

/// Tells of those that are under way where they stand. If all are over, nothing is read.
#[boxed]
pub async fn place(app: &AppState, views: &mut [EvaluationView]) -> Result<(), Problem> {
    if views.iter().all(|view| view.status.is_final()) {
        return Ok(());
    }
    let outlook = queue::outlook(app).await?;
    for view in views {
        view.queue = outlook.evaluations.get(&view.id).copied().map(queue::of);
    }
    Ok(())
}

/// Those of a stage's day.
#[boxed]
pub async fn of_day(
    app: &AppState,
    sight: &Sight,
    of: StageDay,
) -> Result<Vec<EvaluationView>, Problem> {
    all(app, sight, app.store.evaluations_of_day(of).await?).await
}

/// Those of `today`, after what began the day before and is still going.
#[boxed]
pub async fn current(
    app: &AppState,
    sight: &Sight,
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
    all(app, sight, evaluations).await
}

/// These, in their order; without faults and logs, which are long, as in all lists.
#[boxed]
pub async fn all(
    app: &AppState,
    sight: &Sight,
    evaluations: Vec<Evaluation>,
) -> Result<Vec<EvaluationView>, Problem> {
    let teams = app.store.teams().await?;
    let names: BTreeMap<TeamId, TeamName> =
        teams.into_iter().map(|team| (team.id, team.name)).collect();
    evaluations
        .into_iter()
        .map(|evaluation| match names.get(&evaluation.team) {
            Some(name) => Ok(view(sight, evaluation, name.clone())),
            None => Err(Problem::internal(format_args!(
                "evaluation {} has no team",
                evaluation.id
            ))),
        })
        .collect()
}

fn view(sight: &Sight, evaluation: Evaluation, team_name: TeamName) -> EvaluationView {
    let released = evaluation.released_at.is_some();
    let has_dataset = evaluation.dataset_removed.is_none();
    let (hidden, public) = (
        sight.is_hidden(evaluation.of.stage),
        sight.is_public(&evaluation),
    );
    let episodes_total = evaluation.plan.episodes_total();
    let episodes_done = match &evaluation.state {
        EvaluationState::Running { episodes_done, .. } => *episodes_done,
        EvaluationState::Finalising | EvaluationState::Finished { .. } => episodes_total,
        EvaluationState::Queued
        | EvaluationState::AgentFailed { .. }
        | EvaluationState::PlatformFailed { .. }
        | EvaluationState::NotPlayed { .. }
        | EvaluationState::Cancelled { .. } => 0,
    };
    let status = match evaluation.state {
        EvaluationState::Queued => EvaluationStatus::Queued,
        EvaluationState::Running { .. } => EvaluationStatus::Running,
        EvaluationState::Finalising => EvaluationStatus::Finalising,
        EvaluationState::Finished {
            finished_at,
            result,
            dataset_blake3,
            ..
        } => EvaluationStatus::Finished {
            finished_at,
            result: (!hidden).then(|| Box::new(ResultView::new(*result, released))),
            dataset: (!hidden && has_dataset)
                .then(|| format!("{}/dataset", paths::evaluation(evaluation.id))),
            dataset_blake3: dataset_blake3.filter(|_| !hidden),
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
            reason: shown(reason),
        },
        EvaluationState::NotPlayed {
            finished_at,
            reason,
        } => EvaluationStatus::NotPlayed {
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
    let voided = evaluation.voided.is_some();
    EvaluationView {
        id: evaluation.id,
        submission: evaluation.submission,
        team: evaluation.team,
        team_name,
        stage: evaluation.of.stage,
        revision: evaluation.revision,
        day: evaluation.of.date,
        released_at: evaluation.released_at,
        deadline_at: evaluation.deadline_at,
        rerun_of: evaluation.rerun_of,
        extra_turn: evaluation.extra_for,
        voided: evaluation.voided.map(ruling::of),
        blind: hidden,
        public,
        dataset_removed: evaluation.dataset_removed.map(ruling::of),
        profile: evaluation.plan.profile,
        tasks: evaluation.plan.tasks,
        episodes_per_task: evaluation.plan.episodes_per_task,
        created_at: evaluation.created_at,
        progress: Progress {
            episodes_done,
            episodes_total,
        },
        queue: None,
        next: match status.next(released, voided) {
            EvaluationStatus::DONE if !has_dataset => DATASET_GONE,
            next => next,
        }
        .to_owned(),
        status,
    }
}

/// Of a finished evaluation: which episodes were solved, and how sure its tiers are.
#[boxed]
pub async fn summary(
    view: &EvaluationView,
    app: &AppState,
) -> Result<Arc<EpisodeSummary>, Problem> {
    let run = app.store.evaluation(view.id).await?.run;
    app.summaries.of_run(run).await
}

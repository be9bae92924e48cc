//! An evaluation on its way to a score or a failure.

use super::{
    queue::{self, QueueView},
    ruling::RulingView,
    sight::Sight,
};
use crate::{app::AppState, paths, problem::Problem, views::shown};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Evaluation, EvaluationState};
use faceoff_types::{
    EvaluationId, Profile, StageDay, StageId, SubmissionId, Task, TeamId, TeamName,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, sync::Arc};
use utoipa::ToSchema;

pub use super::evaluation_status::{EvaluationStatus, FaultView, ResultView};

/// One run of a submission over the tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvaluationView {
    /// Names the evaluation in paths.
    pub id: EvaluationId,
    /// The submission that plays.
    pub submission: SubmissionId,
    /// The submission's team.
    pub team: TeamId,
    /// As the board shows it.
    pub team_name: TeamName,
    /// Whose day it plays.
    pub stage: StageId,
    /// By which of the stage's rules.
    pub revision: u32,
    /// The date, in the stage's zone, whose episodes it plays.
    pub day: Date,
    /// When the day's last evaluation had ended, and all of the day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// What is not played by then is ended, until the day is released; null: however long it takes.
    pub deadline_at: Option<Timestamp>,
    /// The evaluation that it plays again, one that was cancelled, voided or failed by our fault; absent
    /// otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rerun_of: Option<EvaluationId>,
    /// It is a turn beside the day's own, and why; absent otherwise. Given after the day's release it plays other
    /// episodes than the day's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_turn: Option<String>,
    /// It does not count, if it was voided; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voided: Option<RulingView>,
    /// Its stage is blind: its result is hidden until the organiser opens that; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Everybody sees it and its dataset, without a token.
    pub public: bool,
    /// Its dataset was removed, if it was: when, and by which retention; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset_removed: Option<RulingView>,
    /// The perturbations.
    pub profile: Profile,
    /// In the order of play.
    pub tasks: Vec<Task>,
    /// Episodes of each task.
    pub episodes_per_task: u32,
    /// When it was queued.
    pub created_at: Timestamp,
    /// How far it is.
    pub progress: Progress,
    /// Where it stands in the queue; absent once it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next.
    pub next: String,
    /// What has become of it.
    #[serde(flatten)]
    pub status: EvaluationStatus,
}

/// What happens next to a finished evaluation of a released day without its dataset.
const DATASET_GONE: &str = "Nothing more: its result stays, its dataset was removed.";

/// How much of an evaluation or of an ablation is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Episodes played.
    pub episodes_done: u32,
    /// Episodes to play, over all tasks (and profiles).
    pub episodes_total: u32,
}

impl EvaluationView {
    pub(crate) async fn find(
        app: &AppState,
        sight: &Sight,
        id: EvaluationId,
    ) -> Result<Self, Problem> {
        Self::of(app, sight, app.store.evaluation(id).await?).await
    }

    /// With its place in the queue while it is under way; with faults and log, if it failed by them, its day is
    /// released, and the viewer may see them.
    pub(crate) async fn of(
        app: &AppState,
        sight: &Sight,
        evaluation: Evaluation,
    ) -> Result<Self, Problem> {
        let team = app.store.team(evaluation.team).await?;
        let run = evaluation.run;
        let tells_faults = sight.is_own(&evaluation) && !sight.is_hidden(evaluation.of.stage);
        let mut view = Self::new(sight, evaluation, team.name);
        if let EvaluationStatus::AgentFailed { faults, log, .. } = &mut view.status
            && view.released_at.is_some()
            && tells_faults
        {
            let of_run = app.store.run_faults(run).await?;
            *faults = Some(of_run.faults.into_iter().map(FaultView::from).collect());
            *log = Some(shown(of_run.log));
        }
        Self::place(app, std::slice::from_mut(&mut view)).await?;
        Ok(view)
    }

    /// Tells of those that are under way where they stand. If all are over, nothing is read.
    pub(crate) async fn place(app: &AppState, views: &mut [Self]) -> Result<(), Problem> {
        if views.iter().all(|view| view.status.is_final()) {
            return Ok(());
        }
        let outlook = queue::outlook(app).await?;
        for view in views {
            view.queue = outlook.evaluations.get(&view.id).copied().map(Into::into);
        }
        Ok(())
    }

    /// Those of a stage's day.
    pub(crate) async fn of_day(
        app: &AppState,
        sight: &Sight,
        of: StageDay,
    ) -> Result<Vec<Self>, Problem> {
        Self::all(app, sight, app.store.evaluations_of_day(of).await?).await
    }

    /// Those of `today`, after what began the day before and is still going.
    pub(crate) async fn current(
        app: &AppState,
        sight: &Sight,
        today: StageDay,
    ) -> Result<Vec<Self>, Problem> {
        let mut evaluations = match today.date.yesterday() {
            Ok(date) => {
                let yesterday = StageDay { date, ..today };
                app.store.evaluations_of_day(yesterday).await?
            }
            Err(_) => Vec::new(),
        };
        evaluations.retain(|evaluation| !evaluation.state.is_over());
        evaluations.extend(app.store.evaluations_of_day(today).await?);
        Self::all(app, sight, evaluations).await
    }

    /// These, in their order; without faults and logs, which are long, as in all lists.
    pub(crate) async fn all(
        app: &AppState,
        sight: &Sight,
        evaluations: Vec<Evaluation>,
    ) -> Result<Vec<Self>, Problem> {
        let teams = app.store.teams().await?;
        let names: BTreeMap<TeamId, TeamName> =
            teams.into_iter().map(|team| (team.id, team.name)).collect();
        evaluations
            .into_iter()
            .map(|evaluation| match names.get(&evaluation.team) {
                Some(name) => Ok(Self::new(sight, evaluation, name.clone())),
                None => Err(Problem::internal(format_args!(
                    "evaluation {} has no team",
                    evaluation.id
                ))),
            })
            .collect()
    }

    fn new(sight: &Sight, evaluation: Evaluation, team_name: TeamName) -> Self {
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
        Self {
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
            voided: evaluation.voided.map(RulingView::from),
            blind: hidden,
            public,
            dataset_removed: evaluation.dataset_removed.map(RulingView::from),
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
    pub(crate) async fn summary(&self, app: &AppState) -> Result<Arc<EpisodeSummary>, Problem> {
        let run = app.store.evaluation(self.id).await?.run;
        app.summaries.of_run(run).await
    }
}

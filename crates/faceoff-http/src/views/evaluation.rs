//! An evaluation on its way to a score or a failure.

use super::{ruling::RulingView, sight::Sight, task::TaskView};
use crate::{app::AppState, paths, problem::Problem, views::shown};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Evaluation, EvaluationState};
use faceoff_types::{
    AgentFault, EvaluationId, EvaluationResult, Profile, Seed, SlotTiming, StageDay, StageId,
    SubmissionId, Task, TeamId, TeamName, Tier, Variation,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, sync::Arc};
use utoipa::ToSchema;

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
    /// The evaluation that it plays again, one that was cancelled, voided or failed by our fault; absent
    /// otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rerun_of: Option<EvaluationId>,
    /// It does not count, if it was voided; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voided: Option<RulingView>,
    /// Its stage is blind: its result is hidden until the organiser opens that; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Everybody sees it and its dataset, without a token.
    pub public: bool,
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
    /// What has become of it.
    #[serde(flatten)]
    pub status: EvaluationStatus,
}

/// How much of an evaluation or of an ablation is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Episodes played.
    pub episodes_done: u32,
    /// Episodes to play, over all tasks (and profiles).
    pub episodes_total: u32,
}

/// What has become of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum EvaluationStatus {
    /// It waits for a worker.
    Queued,
    /// Episodes are being played.
    Running,
    /// All episodes are played, the score is being computed.
    Finalising,
    /// It has a score.
    Finished {
        /// When the score was published.
        finished_at: Timestamp,
        /// The score; absent while the stage is blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        result: Option<Box<ResultView>>,
        /// Path of the recorded dataset on this server; absent while the stage is blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset: Option<String>,
        /// BLAKE3 of its archive, 64 hexadecimal digits; absent for datasets of older versions, and while the stage is
        /// blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset_blake3: Option<String>,
    },
    /// The agent broke the protocol or a limit too often; no score.
    AgentFailed {
        /// When the last of its faults was stored.
        finished_at: Timestamp,
        /// What the agent did; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<FaultView>>,
        /// Last part of the agent's standard error; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// Our fault. It is played again, with the same submission on the same episodes: twice by itself,
    /// then if the organiser wants it.
    PlatformFailed {
        /// When we gave it up.
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// Stopped by the organiser.
    Cancelled {
        /// When it was stopped.
        finished_at: Timestamp,
        /// The organiser's words.
        reason: String,
    },
}

impl EvaluationStatus {
    /// Will nothing change any more?
    #[must_use]
    pub const fn is_final(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running | Self::Finalising)
    }
}

/// The score of one evaluation; laid out as `results.json` of the dataset, of which only score and points
/// are told until the day is released.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ResultView {
    /// The rules that it was scored by.
    pub ruleset: String,
    /// The perturbations.
    pub profile: Profile,
    /// What it was played and scored by otherwise than the ruleset has it.
    #[serde(flatten)]
    pub variation: Variation,
    /// The seed of the day's evaluations, 64 hexadecimal digits; null until the day is released.
    pub seed: Option<Seed>,
    /// By task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskView>,
    /// Overall score in percent.
    pub score: f64,
    /// Penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// The worst of the tasks' tiers.
    pub tier: Tier,
    /// The slots' noise floor and re-runs; absent until the day is released, and in results of older
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<SlotTiming>,
}

impl ResultView {
    fn new(result: EvaluationResult, released: bool) -> Self {
        let tasks = result.tasks.iter();
        Self {
            ruleset: result.ruleset,
            profile: result.profile,
            variation: result.variation,
            seed: released.then_some(result.seed),
            tasks: tasks
                .map(|(task, result)| (*task, TaskView::new(result, released)))
                .collect(),
            score: result.score,
            penalty_points: result.penalty_points,
            tier: result.tier,
            timing: result.timing.filter(|_| released),
        }
    }
}

/// Something an agent did wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FaultView {
    /// What it did, in words.
    pub message: String,
    /// In which task.
    pub task: String,
    /// In which episode; null during start-up.
    pub episode: Option<u32>,
    /// At which control step; null outside of an episode.
    pub step: Option<u32>,
    /// The offending line, cut, where there was one.
    pub line: Option<String>,
}

impl From<AgentFault> for FaultView {
    fn from(fault: AgentFault) -> Self {
        Self {
            message: shown(fault.fault.to_string()),
            task: fault.contest.to_string(),
            episode: fault.episode,
            step: fault.step,
            line: fault.line.map(shown),
        }
    }
}

impl EvaluationView {
    pub(crate) async fn find(
        app: &AppState,
        sight: &Sight,
        id: EvaluationId,
    ) -> Result<Self, Problem> {
        Self::of(app, sight, app.store.evaluation(id).await?).await
    }

    /// With faults and log, if it failed by them, its day is released, and the viewer may see them.
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
        Ok(view)
    }

    /// All evaluations of a date, of all stages, in the order in which they were queued; without faults and
    /// logs, which are long, as in all lists.
    pub(crate) async fn all_on(
        app: &AppState,
        sight: &Sight,
        date: Date,
    ) -> Result<Vec<Self>, Problem> {
        Self::all(app, sight, app.store.evaluations_on(date).await?).await
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

    /// Of a team, newest first.
    pub(crate) async fn of_team(
        app: &AppState,
        sight: &Sight,
        team: TeamId,
    ) -> Result<Vec<Self>, Problem> {
        Self::all(app, sight, app.store.evaluations_of(team).await?).await
    }

    async fn all(
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
                dataset: (!hidden).then(|| format!("{}/dataset", paths::evaluation(evaluation.id))),
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
            EvaluationState::Cancelled {
                finished_at,
                reason,
            } => EvaluationStatus::Cancelled {
                finished_at,
                reason,
            },
        };
        Self {
            id: evaluation.id,
            submission: evaluation.submission,
            team: evaluation.team,
            team_name,
            stage: evaluation.of.stage,
            revision: evaluation.revision,
            day: evaluation.of.date,
            released_at: evaluation.released_at,
            rerun_of: evaluation.rerun_of,
            voided: evaluation.voided.map(RulingView::from),
            blind: hidden,
            public,
            profile: evaluation.plan.profile,
            tasks: evaluation.plan.tasks,
            episodes_per_task: evaluation.plan.episodes_per_task,
            created_at: evaluation.created_at,
            progress: Progress {
                episodes_done,
                episodes_total,
            },
            status,
        }
    }

    /// Of a finished evaluation: which episodes were solved, and how sure its tiers are.
    pub(crate) async fn summary(&self, app: &AppState) -> Result<Arc<EpisodeSummary>, Problem> {
        let run = app.store.evaluation(self.id).await?.run;
        app.summaries.of_run(run).await
    }
}

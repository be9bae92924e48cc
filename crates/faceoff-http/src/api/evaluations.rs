//! Evaluations: progress, verdict, result and dataset.

use super::schema::{self, ProblemBody};
use crate::{
    App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam, QueryParams},
    problem::{Problem, ProblemKind},
    seeds::DaySeeds,
};
use axum::{
    Json, body,
    extract::State,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_store::{Actor, Evaluation, EvaluationState};
use faceoff_types::{
    AgentFault, EvaluationId, EvaluationResult, Profile, Seed, SlotTiming, SubmissionId, Task,
    TaskResult, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::{IntoParams, ToSchema};

/// Longest reason of a cancellation.
const MAX_REASON_CHARS: usize = 500;

/// One run of a submission over the tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvaluationView {
    /// Its id.
    #[schema(value_type = String, format = Uuid)]
    pub id: EvaluationId,
    /// The submission that plays.
    #[schema(value_type = String, format = Uuid)]
    pub submission: SubmissionId,
    /// The submission's team.
    #[schema(value_type = String, format = Uuid)]
    pub team: TeamId,
    /// The team's name.
    #[schema(value_type = String)]
    pub team_name: TeamName,
    /// The UTC day whose turn it uses.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// The perturbation profile.
    #[schema(value_type = String, example = "evaluation")]
    pub profile: Profile,
    /// The tasks.
    #[schema(value_type = Vec<String>)]
    pub tasks: Vec<Task>,
    /// Episodes of each task.
    pub episodes_per_task: u32,
    /// When it was queued.
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Timestamp,
    /// How far it is.
    pub progress: Progress,
    /// What has become of it.
    #[serde(flatten)]
    pub status: EvaluationStatus,
}

/// How far an evaluation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Episodes played.
    pub episodes_done: u32,
    /// Episodes to play.
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
    /// Done.
    Finished {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// The score.
        result: Box<ResultView>,
        /// Path of the recorded dataset on this server.
        dataset: String,
    },
    /// The agent broke the protocol or a limit too often; no score.
    AgentFailed {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// What the agent did; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<FaultView>>,
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// Our fault; the day's turn was given back.
    PlatformFailed {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// Stopped by the organiser.
    Cancelled {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// Why.
        reason: String,
    },
}

/// The score of one evaluation; laid out as `results.json` of the dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ResultView {
    /// The ruleset's name.
    pub ruleset: String,
    /// The perturbation profile.
    #[schema(value_type = String)]
    pub profile: Profile,
    /// The seed of the day's evaluations, 64 hexadecimal digits; null while teams that have not used
    /// their turn must not know their episodes.
    #[schema(value_type = Option<String>)]
    pub seed: Option<Seed>,
    /// By task: hit, defend, prepare.
    #[schema(value_type = BTreeMap<String, schema::TaskResult>)]
    pub tasks: BTreeMap<Task, TaskResult>,
    /// Overall score in percent.
    pub score: f64,
    /// Penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// deployable, improvable or non_deployable.
    #[schema(value_type = String)]
    pub tier: Tier,
    /// The slots' noise floor and re-runs; absent in results of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<schema::SlotTiming>)]
    pub timing: Option<SlotTiming>,
}

impl ResultView {
    fn new(result: EvaluationResult, seed: Option<Seed>) -> Self {
        Self {
            ruleset: result.ruleset,
            profile: result.profile,
            seed,
            tasks: result.tasks,
            score: result.score,
            penalty_points: result.penalty_points,
            tier: result.tier,
            timing: result.timing,
        }
    }
}

impl EvaluationStatus {
    /// Will nothing change any more?
    #[must_use]
    pub const fn is_final(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running | Self::Finalising)
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
            message: fault.fault.to_string(),
            task: fault.contest.to_string(),
            episode: fault.episode,
            step: fault.step,
            line: fault.line,
        }
    }
}

impl Progress {
    pub(crate) fn of(evaluation: &Evaluation) -> Self {
        let planned = evaluation.plan.episodes_total();
        let (episodes_done, episodes_total) = match evaluation.state {
            EvaluationState::Running {
                episodes_done,
                episodes_total,
            } => (episodes_done, episodes_total),
            EvaluationState::Finalising | EvaluationState::Finished { .. } => (planned, planned),
            EvaluationState::Queued
            | EvaluationState::AgentFailed { .. }
            | EvaluationState::PlatformFailed { .. }
            | EvaluationState::Cancelled { .. } => (0, planned),
        };
        Self {
            episodes_done,
            episodes_total,
        }
    }
}

impl EvaluationView {
    fn new(evaluation: Evaluation, team_name: TeamName, seeds: &DaySeeds) -> Self {
        let progress = Progress::of(&evaluation);
        let status = match evaluation.state {
            EvaluationState::Queued => EvaluationStatus::Queued,
            EvaluationState::Running { .. } => EvaluationStatus::Running,
            EvaluationState::Finalising => EvaluationStatus::Finalising,
            EvaluationState::Finished {
                finished_at,
                result,
                ..
            } => EvaluationStatus::Finished {
                finished_at,
                result: {
                    let seed = seeds.public(result.seed, evaluation.day);
                    Box::new(ResultView::new(*result, seed))
                },
                dataset: format!("{}/evaluations/{}/dataset", super::BASE, evaluation.id),
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
        Self {
            id: evaluation.id,
            submission: evaluation.submission,
            team: evaluation.team,
            team_name,
            day: evaluation.day,
            profile: evaluation.plan.profile,
            tasks: evaluation.plan.tasks,
            episodes_per_task: evaluation.plan.episodes_per_task,
            created_at: evaluation.created_at,
            progress,
            status,
        }
    }
}

/// An evaluation with its team's name, and with faults and log if it failed by them.
pub(crate) async fn with_name(
    app: &App,
    evaluation: Evaluation,
) -> Result<EvaluationView, Problem> {
    let team = app.store.team(evaluation.team).await?;
    let seeds = app.day_seeds([evaluation.day].into()).await?;
    let run = evaluation.run;
    let mut view = EvaluationView::new(evaluation, team.name, &seeds);
    if let EvaluationStatus::AgentFailed { faults, log, .. } = &mut view.status {
        let of_run = app.store.run_faults(run).await?;
        *faults = Some(of_run.faults.into_iter().map(FaultView::from).collect());
        *log = Some(of_run.log);
    }
    Ok(view)
}

/// Evaluations with their teams' names.
pub(crate) async fn with_names(
    app: &App,
    evaluations: Vec<Evaluation>,
) -> Result<Vec<EvaluationView>, Problem> {
    let names: BTreeMap<TeamId, TeamName> = app
        .store
        .teams()
        .await?
        .into_iter()
        .map(|team| (team.id, team.name))
        .collect();
    let days = evaluations.iter().map(|evaluation| evaluation.day);
    let seeds = app.day_seeds(days.collect()).await?;
    evaluations
        .into_iter()
        .map(|evaluation| match names.get(&evaluation.team) {
            Some(name) => Ok(EvaluationView::new(evaluation, name.clone(), &seeds)),
            None => Err(Problem::internal(format_args!(
                "evaluation {} has no team",
                evaluation.id
            ))),
        })
        .collect()
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct DayQuery {
    /// UTC day, e.g. 2026-11-21. The organiser gets today's without it, a team all of its own.
    #[param(value_type = Option<String>, format = Date)]
    day: Option<civil::Date>,
}

/// The organiser: all evaluations of a day. A team: its own.
#[utoipa::path(
    get, path = "/evaluations", tag = "team", security(("team" = []), ("organiser" = [])),
    params(DayQuery), responses((status = 200, body = Vec<EvaluationView>))
)]
pub(crate) async fn list_evaluations(
    caller: Caller,
    State(app): State<App>,
    QueryParams(query): QueryParams<DayQuery>,
) -> Result<Json<Vec<EvaluationView>>, Problem> {
    let evaluations = match caller {
        Caller::Organiser => {
            let day = query.day.unwrap_or_else(|| app.config.clock.today());
            app.store.evaluations_on(day).await?
        }
        Caller::Team(team) => {
            let mut own = app.store.evaluations_of(team.id).await?;
            own.retain(|evaluation| query.day.is_none_or(|day| evaluation.day == day));
            own
        }
    };
    with_names(&app, evaluations).await.map(Json)
}

/// One evaluation: state, progress, and once it is over the result or the faults with the log.
#[utoipa::path(
    get, path = "/evaluations/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = EvaluationView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn evaluation(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Json<EvaluationView>, Problem> {
    let evaluation = visible(&app, &caller, id).await?;
    with_name(&app, evaluation).await.map(Json)
}

/// Why an evaluation is stopped.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cancellation {
    /// Shown to the team; 1 to 500 characters.
    pub reason: String,
}

/// Stops an evaluation that is not over and gives the team's turn of the day back.
#[utoipa::path(
    post, path = "/evaluations/{id}/cancel", tag = "organiser", security(("organiser" = [])),
    params(("id" = String, Path, format = Uuid)), request_body = Cancellation,
    responses(
        (status = 200, body = EvaluationView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
        (status = 409, description = "it is over already", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn cancel_evaluation(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    Body(Cancellation { reason }): Body<Cancellation>,
) -> Result<Json<EvaluationView>, Problem> {
    let chars = reason.trim().chars().count();
    if !(1..=MAX_REASON_CHARS).contains(&chars) {
        return Err(Problem::new(
            ProblemKind::InvalidContent,
            format!("reason: expected 1 to {MAX_REASON_CHARS} characters, got {chars}"),
        )
        .with("field", "reason"));
    }
    app.store
        .cancel_evaluation(Actor::Organiser, id, reason.trim(), app.config.clock.now())
        .await?;
    tracing::info!(evaluation = %id, reason, "evaluation cancelled");
    let evaluation = app.store.evaluation(id).await?;
    with_name(&app, evaluation).await.map(Json)
}

/// The recorded dataset, a zip archive; for its team and the organiser.
///
/// It carries the day's seed. So it is handed out once no evaluation of the day is under way, and the
/// first one handed out ends the day for what is uploaded after it.
#[utoipa::path(
    get, path = "/evaluations/{id}/dataset", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = Vec<u8>, content_type = "application/zip"),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
        (status = 409, description = "not finished yet, or failed, or other evaluations of its day are under way", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn dataset(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let evaluation = visible(&app, &caller, id).await?;
    let why_not = match &evaluation.state {
        EvaluationState::Finished { dataset, .. } => {
            app.release_day(caller.actor(), evaluation.day).await?;
            // A dataset that a finished evaluation names must be there: without it, we lost it.
            let (bytes, stream) = app
                .store
                .artifacts()
                .read(dataset)
                .await
                .map_err(Problem::internal)?;
            let team = app.store.team(evaluation.team).await?;
            let name = download_name(team.name.as_str(), evaluation.day);
            let disposition = HeaderValue::try_from(format!("attachment; filename=\"{name}\""))
                .map_err(Problem::internal)?;
            let headers = [
                (
                    header::CONTENT_TYPE,
                    HeaderValue::from_static("application/zip"),
                ),
                (header::CONTENT_LENGTH, HeaderValue::from(bytes)),
                (header::CONTENT_DISPOSITION, disposition),
            ];
            return Ok((headers, body::Body::from_stream(stream)).into_response());
        }
        EvaluationState::Queued | EvaluationState::Running { .. } | EvaluationState::Finalising => {
            "the evaluation is not finished; follow it until its state is “finished”"
        }
        EvaluationState::AgentFailed { .. } => {
            "the agent failed too often, so there is no dataset; its faults and log are in \
             GET /api/v1/evaluations/ID"
        }
        EvaluationState::PlatformFailed { .. } => {
            "the evaluation failed by our fault and has no dataset; the day's turn was given back"
        }
        EvaluationState::Cancelled { .. } => "the evaluation was cancelled and has no dataset",
    };
    Err(Problem::new(ProblemKind::Conflict, why_not))
}

/// A file name without anything that a header or a file system could trip over.
fn download_name(team: &str, day: civil::Date) -> String {
    let team: String = team
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    format!("faceoff-{team}-{day}.zip")
}

/// The evaluation, if the caller may see it; another team's looks like none at all.
async fn visible(app: &App, caller: &Caller, id: EvaluationId) -> Result<Evaluation, Problem> {
    let evaluation = app.store.evaluation(id).await?;
    if caller.may_see(evaluation.team) {
        Ok(evaluation)
    } else {
        Err(Problem::not_found("evaluation"))
    }
}

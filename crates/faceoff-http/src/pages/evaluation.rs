//! `/evaluations/{id}`: what everybody may know of an evaluation. Log, faults and dataset are its
//! team's and stay in the API.

use super::{Frame, PageProblem, figures, render};
use crate::{
    App,
    api::{board::public_seed, evaluations::Progress},
    extract::PathParam,
    problem::Problem,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_store::EvaluationState;
use faceoff_types::{
    EvaluationId, EvaluationResult, Profile, RoundTrips, SlotTiming, Task, TaskResult,
};
use figures::Rate;
use jiff::civil;

/// A task's results, in words.
struct TaskFigures {
    task: Task,
    rate: Rate,
    successes: u32,
    episodes: u32,
    penalty_points: String,
    per_episode: String,
    tier_name: &'static str,
    tier_title: &'static str,
    tier_sign: &'static str,
    steps: u64,
    ee: String,
    link: String,
    joint_pos: String,
    joint_vel: String,
    computation_time: String,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TaskFigures {
    fn of(task: Task, result: &TaskResult) -> Self {
        let violations = result.violations;
        let count = |violations| figures::share(violations, result.episodes);
        let time = result.computation_time_s;
        Self {
            task,
            rate: Rate::of(result),
            successes: result.successes,
            episodes: result.episodes,
            penalty_points: figures::one(result.penalty_points),
            per_episode: figures::per_episode(result.penalty_points, result.episodes),
            tier_name: result.tier.as_str(),
            tier_title: result.tier.title(),
            tier_sign: figures::tier_sign(result.tier),
            steps: result.steps,
            ee: count(violations.ee),
            link: count(violations.link),
            joint_pos: count(violations.joint_pos),
            joint_vel: count(violations.joint_vel),
            computation_time: count(violations.computation_time),
            mean_ms: figures::milliseconds(time.mean),
            p99_ms: figures::milliseconds(time.p99),
            max_ms: figures::milliseconds(time.max),
        }
    }
}

/// A finished evaluation.
struct Finished {
    score: String,
    penalty_points: String,
    tier_name: &'static str,
    tier_title: &'static str,
    tier_sign: &'static str,
    tier_bounds: &'static str,
    ruleset: String,
    seed: Option<String>,
    finished_at: String,
    tasks: Vec<TaskFigures>,
    timing: Option<TimingFigures>,
}

/// How evenly the slots kept time, in words.
struct TimingFigures {
    before: RoundTripFigures,
    during: RoundTripFigures,
    /// `None` when there was none.
    longest_stall_ms: Option<String>,
    host_noise_reruns: u32,
}

/// Round trips to the calibration agent, in milliseconds.
struct RoundTripFigures {
    count: u32,
    p50_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TimingFigures {
    fn of(timing: &SlotTiming) -> Self {
        let figures = |trips: RoundTrips| RoundTripFigures {
            count: trips.count,
            p50_ms: figures::fine_milliseconds(trips.p50),
            p99_ms: figures::fine_milliseconds(trips.p99),
            max_ms: figures::fine_milliseconds(trips.max),
        };
        Self {
            before: figures(timing.before_s),
            during: figures(timing.during_s),
            longest_stall_ms: (timing.longest_stall_s > 0.0)
                .then(|| figures::milliseconds(timing.longest_stall_s)),
            host_noise_reruns: timing.host_noise_reruns,
        }
    }
}

#[derive(Template)]
#[template(path = "evaluation.html")]
struct Page {
    frame: Frame,
    team: String,
    agent: Option<String>,
    day: civil::Date,
    profile: Profile,
    /// Path of the page of its submission's ablation, if there is one.
    ablation: Option<String>,
    /// Said when there is no result.
    state: &'static str,
    progress: Option<Progress>,
    finished: Option<Finished>,
}

/// One evaluation.
pub(super) async fn page(
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let evaluation = app.store.evaluation(id).await?;
    let team = app.store.team(evaluation.team).await?;
    let submission = app.store.submission(evaluation.submission).await?;
    let ablation = app.store.newest_ablation(submission.id).await?;
    let season = app.season().await?;
    let today = app.config.clock.today();
    let progress = Progress::of(&evaluation);
    let (state, moving) = match &evaluation.state {
        EvaluationState::Queued => ("It waits for a worker.", true),
        EvaluationState::Running { .. } => ("Episodes are being played.", true),
        EvaluationState::Finalising => (
            "All episodes are played; the score is being computed.",
            true,
        ),
        EvaluationState::Finished { .. } => ("", false),
        EvaluationState::AgentFailed { .. } => (
            "The agent broke the protocol or a limit too often and was stopped; there is no score. \
             Its team sees the faults and the log.",
            false,
        ),
        EvaluationState::PlatformFailed { .. } => (
            "It was stopped by a fault of this server, not of the agent. The team's turn was given back.",
            false,
        ),
        EvaluationState::Cancelled { .. } => ("The organiser cancelled it.", false),
    };
    let finished = match &evaluation.state {
        EvaluationState::Finished {
            finished_at,
            result,
            ..
        } => {
            let finished_at = finished_at.strftime("%Y-%m-%d %H:%M UTC").to_string();
            let seed = public_seed(result.seed, evaluation.day, today).map(|seed| seed.to_string());
            Some(finished(result, seed, finished_at))
        }
        _ => None,
    };
    render(&Page {
        frame: Frame::new(season.name, ""),
        team: team.name.to_string(),
        agent: submission.agent_name,
        day: evaluation.day,
        profile: evaluation.plan.profile,
        ablation: ablation.map(|ablation| format!("/submissions/{}/ablation", ablation.submission)),
        state,
        progress: moving.then_some(progress),
        finished,
    })
}

fn finished(result: &EvaluationResult, seed: Option<String>, finished_at: String) -> Finished {
    Finished {
        score: figures::one(result.score),
        penalty_points: figures::one(result.penalty_points),
        tier_name: result.tier.as_str(),
        tier_title: result.tier.title(),
        tier_sign: figures::tier_sign(result.tier),
        tier_bounds: figures::tier_bounds(result.tier),
        ruleset: result.ruleset.clone(),
        seed,
        finished_at,
        tasks: result
            .tasks
            .iter()
            .map(|(task, result)| TaskFigures::of(*task, result))
            .collect(),
        timing: result.timing.as_ref().map(TimingFigures::of),
    }
}

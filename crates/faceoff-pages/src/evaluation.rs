//! `/evaluations/{id}`: what everybody may know of an evaluation. Log, faults and dataset are its
//! team's and stay in the API.

mod slow;

use super::{
    chart::{Counted, Span, Strip},
    figures,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{
    clips::TimeBinView,
    evaluation::{EvaluationStatus, EvaluationView, Progress, ResultView},
    queue::QueueView,
    ruling::RulingView,
    task::TaskView,
};
use faceoff_scoring::{
    EE_POINTS, EpisodeSummary, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS,
    TIER_CHANGE_RESAMPLES,
};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::Problem,
    viewer::Viewer,
    views::{ablation, clips::Clips, evaluation, season::SeasonHead, sight::Sight, submission},
};
use faceoff_types::{
    EvaluationId, Profile, RoundTrips, Seed, SlotTiming, StageDay, Task, ViolationCounts,
};
use figures::{Rate, minute};
use jiff::{Timestamp, civil};
use slow::SlowAnswers;
use std::collections::BTreeMap;

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
    tier_change: String,
    details: Option<TaskDetails>,
}

/// What is told of a task once its day is released.
struct TaskDetails {
    steps: u64,
    /// End effector, elbow and wrist, joint position, joint velocity, answer time.
    broken: [Broken; 5],
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TaskFigures {
    fn of(task: Task, result: &TaskView, summary: &EpisodeSummary) -> Self {
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
            tier_change: figures::chance(summary.tier_change_of(Some(task))),
            details: TaskDetails::of(result),
        }
    }
}

/// What one kind of violation came to.
struct Broken {
    share: String,
    /// What it cost; `None` of nothing.
    points: Option<String>,
}

impl Broken {
    fn of(result: &TaskView, violations: ViolationCounts) -> [Self; 5] {
        let of_motion = [
            (violations.ee, EE_POINTS),
            (violations.link, LINK_POINTS),
            (violations.joint_pos, JOINT_POS_POINTS),
            (violations.joint_vel, JOINT_VEL_POINTS),
        ];
        let of_motion = of_motion.map(|(count, each)| (count, f64::from(count) * each));
        // How much a slow answer costs depends on how slow it was: it is what remains.
        let rest: f64 = of_motion.iter().map(|(_, points)| points).sum();
        let slow = (result.penalty_points - rest).max(0.0);
        let [ee, link, joint_pos, joint_vel] = of_motion;
        [
            ee,
            link,
            joint_pos,
            joint_vel,
            (violations.computation_time, slow),
        ]
        .map(|(count, points)| Self {
            share: figures::share(count, result.episodes),
            points: (count > 0).then(|| figures::one(points)),
        })
    }
}

impl TaskDetails {
    fn of(result: &TaskView) -> Option<Self> {
        let (violations, time) = (result.violations?, result.computation_time_s?);
        Some(Self {
            steps: result.steps?,
            broken: Broken::of(result, violations),
            mean_ms: figures::milliseconds(time.mean),
            p99_ms: figures::milliseconds(time.p99),
            max_ms: figures::milliseconds(time.max),
        })
    }
}

struct Finished {
    score: Rate,
    penalty_points: String,
    tier_name: &'static str,
    tier_title: &'static str,
    tier_sign: &'static str,
    tier_bounds: String,
    tier_change: String,
    resamples: u32,
    ruleset: String,
    seed: Option<String>,
    /// Of the dataset's archive.
    dataset_blake3: Option<String>,
    finished_at: Timestamp,
    tasks: Vec<TaskFigures>,
    /// Evaluations that met the same episodes.
    others: Vec<Other>,
    timing: Option<TimingFigures>,
    /// How long answers took; once the day is released.
    times: Option<Strip>,
    slow: SlowAnswers,
}

/// Another team's evaluation of the same episodes.
struct Other {
    team: String,
    evaluation: EvaluationId,
    score: String,
}

/// How evenly the slots kept time, in words.
struct TimingFigures {
    before: RoundTripFigures,
    during: RoundTripFigures,
    /// `None` when there was none.
    longest_stall_ms: Option<String>,
    host_noise_reruns: u32,
    platform_retries: u32,
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
            platform_retries: timing.platform_retries,
        }
    }
}

#[derive(Template)]
#[template(path = "evaluation.html")]
struct Page {
    frame: Frame,
    id: EvaluationId,
    team: String,
    agent: Option<String>,
    voided: Option<RulingView>,
    extra_turn: Option<String>,
    day: civil::Date,
    profile: Profile,
    /// Path of the page of its submission's ablation, if there is one.
    ablation: Option<String>,
    /// Are its episodes shown, each with a replay?
    has_episodes: bool,
    /// Said when there is no result.
    state: String,
    /// Is its dataset there for everybody?
    public: bool,
    /// When and why it was removed, if it was.
    dataset_removed: Option<RulingView>,
    progress: Option<Progress>,
    /// Where it stands in the queue.
    queue: Option<QueueView>,
    next: String,
    finished: Option<Finished>,
}

impl Page {
    /// What has changed when the page has, in a sentence.
    fn told(&self) -> String {
        match &self.finished {
            Some(done) => format!(
                "The evaluation of {} is finished: score {} percent, {} penalty points.",
                self.team, done.score.percent, done.penalty_points
            ),
            None => self.state.clone(),
        }
    }
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let sight = Sight::of(&app, viewer?).await?;
    let view = evaluation::find(&app, &sight, id).await?;
    let submission = submission::find(&app, view.submission).await?;
    let ablation = ablation::exists(&app, submission.id).await?;
    let season = SeasonHead::now(&app).await?;
    let scored_at = view.status.finished_at();
    let frozen = scored_at.and_then(|at| sight.freeze_hiding(view.stage, at));
    let clips = Clips::of(&app, &sight, id).await.ok();
    let distributions = match &clips {
        Some(clips) => clips.computation_times().await?,
        None => BTreeMap::new(),
    };
    let finished = match &view.status {
        _ if frozen.is_some() => None,
        EvaluationStatus::Finished {
            finished_at,
            result: Some(result),
            dataset_blake3,
            ..
        } => {
            let summary = evaluation::summary(&view, &app).await?;
            let others = match view.released_at {
                Some(_) => others(&app, &sight, &view, result.seed).await?,
                None => Vec::new(),
            };
            Some(Finished {
                dataset_blake3: dataset_blake3.clone(),
                others,
                slow: SlowAnswers::of(&app, &view, result).await?,
                times: times(result, &distributions),
                ..Finished::of(result, *finished_at, &summary)
            })
        }
        _ => None,
    };
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        id,
        team: view.team_name.to_string(),
        agent: submission.agent_name,
        voided: view.voided.clone(),
        extra_turn: view.extra_turn.clone(),
        day: view.day,
        profile: view.profile,
        has_episodes: clips.is_some(),
        ablation: ablation.then(|| format!("/submissions/{}/ablation", submission.id)),
        state: match frozen {
            Some(frozen) => format!(
                "It is finished. The boards of its stage are frozen since {} ({}): its result is shown once they are \
                 unfrozen.",
                minute(frozen.at),
                frozen.reason
            ),
            None => in_words(&view).to_owned(),
        },
        public: view.public,
        dataset_removed: view.dataset_removed.clone(),
        progress: (!view.status.is_final()).then_some(view.progress),
        queue: view.queue,
        next: view.next.clone(),
        finished,
    })
}

/// What has become of an evaluation without a result.
const fn in_words(view: &EvaluationView) -> &'static str {
    const HIDDEN: &str = "It is over. Its stage is blind: how it went is hidden from everybody until the organiser opens \
                          the stage, and nobody knows when that is.";
    match &view.status {
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. } if view.blind => {
            HIDDEN
        }
        EvaluationStatus::Queued => "It waits for a worker.",
        EvaluationStatus::Running => "Episodes are being played.",
        EvaluationStatus::Finalising => "All episodes are played; the score is being computed.",
        EvaluationStatus::Finished { .. } => "",
        EvaluationStatus::AgentFailed { .. } => {
            "The agent broke the protocol or a limit too often and was stopped; there is no score. \
             Its team sees the faults and the log when the day is released."
        }
        EvaluationStatus::PlatformFailed { .. } => {
            "It was stopped by a fault of this server, not of the agent. The same agent plays the same episodes \
             again, unless the fault stays."
        }
        EvaluationStatus::NotPlayed { .. } => {
            "Its day's deadline came before all of it was played, for want of this server's capacity: by no fault of \
             the agent's."
        }
        EvaluationStatus::Cancelled { .. } => "The organiser cancelled it.",
    }
}

/// The finished evaluations that can be compared with this one, in the order of their scores.
async fn others(
    app: &App,
    sight: &Sight,
    of: &EvaluationView,
    seed: Option<Seed>,
) -> Result<Vec<Other>, PageProblem> {
    let same_episodes = |other: &EvaluationView| {
        other.id != of.id
            && other.voided.is_none()
            && other.profile == of.profile
            && other.episodes_per_task == of.episodes_per_task
            && other.tasks == of.tasks
    };
    let day = StageDay {
        stage: of.stage,
        date: of.day,
    };
    let same_day = evaluation::of_day(app, sight, day).await?;
    let mut others = Vec::new();
    let is_shown = |view: &EvaluationView| {
        let scored_at = view.status.finished_at();
        scored_at.is_none_or(|at| sight.freeze_hiding(view.stage, at).is_none())
    };
    let shown = same_day.into_iter().filter(same_episodes).filter(is_shown);
    for view in shown {
        // An extra turn may have had episodes of its own.
        if let EvaluationStatus::Finished {
            result: Some(result),
            ..
        } = view.status
            && result.seed == seed
        {
            others.push((result.score, view.team_name, view.id));
        }
    }
    others.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.2.cmp(&b.2)));
    Ok(others
        .into_iter()
        .map(|(score, team, evaluation)| Other {
            team: team.to_string(),
            evaluation,
            score: figures::one(score),
        })
        .collect())
}

/// How many control steps were answered in which time.
type Distributions = BTreeMap<Task, Vec<TimeBinView>>;

/// Answer times of all tasks, if they are told.
fn times(result: &ResultView, distributions: &Distributions) -> Option<Strip> {
    let tasks = result.tasks.iter();
    let spans: Vec<Span> = tasks
        .filter_map(|(task, of_task)| {
            let time = of_task.computation_time_s?;
            Some(Span {
                name: task.as_str(),
                mean: 1e3 * time.mean,
                p99: 1e3 * time.p99,
                max: 1e3 * time.max,
                counted: distributions
                    .get(task)
                    .map(|bins| counted(bins))
                    .unwrap_or_default(),
            })
        })
        .collect();
    let floor = result.timing.as_ref().map(|timing| {
        let trips = timing.during_s;
        [1e3 * trips.p50, 1e3 * trips.p99]
    });
    (!spans.is_empty()).then(|| Strip::of(&spans, floor))
}

fn counted(bins: &[TimeBinView]) -> Vec<Counted> {
    let bins = bins.iter().map(|bin| Counted {
        from: 1e3 * bin.from_s,
        to: 1e3 * bin.to_s,
        count: bin.steps,
    });
    bins.collect()
}

impl Finished {
    /// Had any episode a violation?
    fn has_violations(&self) -> bool {
        let details = self.tasks.iter().filter_map(|task| task.details.as_ref());
        let mut kinds = details.flat_map(|details| &details.broken);
        kinds.any(|kind| kind.points.is_some())
    }

    fn of(result: &ResultView, finished_at: Timestamp, summary: &EpisodeSummary) -> Self {
        Self {
            score: Rate::of_score(result.score, &result.tasks, &result.variation.weights),
            penalty_points: figures::one(result.penalty_points),
            tier_name: result.tier.as_str(),
            tier_title: result.tier.title(),
            tier_sign: figures::tier_sign(result.tier),
            tier_bounds: figures::tier_bounds(result.tier, &result.variation.tier_bounds),
            tier_change: figures::chance(summary.tier_change_of(None)),
            resamples: TIER_CHANGE_RESAMPLES,
            ruleset: result.ruleset.clone(),
            seed: result.seed.map(|seed| seed.to_string()),
            finished_at,
            tasks: result
                .tasks
                .iter()
                .map(|(task, result)| TaskFigures::of(*task, result, summary))
                .collect(),
            dataset_blake3: None,
            others: Vec::new(),
            slow: SlowAnswers::default(),
            timing: result.timing.as_ref().map(TimingFigures::of),
            times: None,
        }
    }
}

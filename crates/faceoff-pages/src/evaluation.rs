//! `/evaluations/{id}`: the public page of an evaluation, one team's run of all tasks on a day. Log, faults and dataset are visible to
//! the team only, through the API and the dashboard.

mod slow_answers;

use super::{
    chart::{AnswerTimeChart, TimeBin, TimeSummary},
    format,
    frame::{Frame, NO_ENTRY, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{
    decision::DecisionView,
    episodes::TimeBinView,
    evaluation::{EvaluationStatus, EvaluationView, Progress, ResultView},
    queue::QueueView,
    task::TaskView,
};
use faceoff_scoring::{EpisodeSummary, TIER_CHANGE_RESAMPLES};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::Problem,
    viewer::Viewer,
    views::{ablation, clips::Clips, evaluation, submission, visibility::Visibility},
};
use faceoff_types::{
    Competition, EvaluationId, Profile, RoundTrips, Seed, SlotTiming, StageDay, Task, TaskMap,
    Tier, ViolationCounts, ViolationInfo,
};
use format::{Rate, TierLabel, utc_minute};
use jiff::{Timestamp, civil};
use slow_answers::SlowAnswers;

/// Formatted results of a task.
struct TaskFigures {
    task: Task,
    rate: Rate,
    successes: u32,
    episodes: u32,
    penalty_points: String,
    points_per_episode: String,
    /// `None` in a competition without tiers.
    tier: Option<Tier>,
    /// Probability that other episodes of the same kind would give another tier; empty without tiers.
    tier_change: String,
    details: Option<TaskDetails>,
}

/// Details of a task that are public once the day is released.
struct TaskDetails {
    steps: u64,
    /// In the order of the competition's kinds.
    violations: Vec<ViolationFigures>,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
}

/// The probability of another tier as text; empty without tiers.
fn tier_change(summary: &EpisodeSummary, task: Option<Task>) -> String {
    summary
        .tier_change_of(task)
        .map_or_else(String::new, format::probability)
}

impl TaskFigures {
    fn new(
        task: Task,
        result: &TaskView,
        summary: &EpisodeSummary,
        competition: &Competition,
    ) -> Self {
        Self {
            task,
            rate: Rate::new(result),
            successes: result.successes,
            episodes: result.episodes,
            penalty_points: format::one_decimal(result.penalty_points),
            points_per_episode: format::points_per_episode(result.penalty_points, result.episodes),
            tier: result.tier,
            tier_change: tier_change(summary, Some(task)),
            details: TaskDetails::new(result, competition),
        }
    }
}

/// Episodes with a kind of violation.
struct ViolationFigures {
    /// Their number, and their share of the task's episodes.
    share: String,
    /// Penalty points; `None` without violations.
    points: Option<String>,
}

impl ViolationFigures {
    /// In the order of the competition's kinds.
    fn by_kind(
        result: &TaskView,
        violations: &ViolationCounts,
        competition: &Competition,
    ) -> Vec<Self> {
        let kinds = competition.violations.iter();
        let mut kinds: Vec<(&ViolationInfo, u32, f64)> = kinds
            .map(|info| {
                let count = violations.get(info.name);
                // `points` are the least and the most points of one episode with such a violation.
                (info, count, f64::from(count) * info.points[1])
            })
            .collect();
        // Only late answers have a range of points, since their cost depends on their time. They get the points that the other
        // kinds leave.
        let (late, others): (Vec<_>, Vec<_>) =
            kinds.iter_mut().partition(|(info, ..)| info.has_range());
        let points_of_others: f64 = others.iter().map(|(.., points)| *points).sum();
        for (.., points) in late {
            *points = (result.penalty_points - points_of_others).max(0.0);
        }
        let figures = kinds.into_iter().map(|(_, count, points)| Self {
            share: format::count_with_share(count, result.episodes),
            points: (count > 0).then(|| format::one_decimal(points)),
        });
        figures.collect()
    }
}

impl TaskDetails {
    fn new(result: &TaskView, competition: &Competition) -> Option<Self> {
        let (violations, time) = (result.violations.as_ref()?, result.computation_time_s?);
        Some(Self {
            steps: result.steps?,
            violations: ViolationFigures::by_kind(result, violations, competition),
            mean_ms: format::milliseconds(time.mean),
            p99_ms: format::milliseconds(time.p99),
            max_ms: format::milliseconds(time.max),
        })
    }
}

struct FinalResult {
    score: Rate,
    penalty_points: String,
    /// `None` in a competition without tiers.
    tier: Option<TierLabel>,
    tier_change: String,
    /// Number of random resamples of the episodes (bootstrap) from which `tier_change` was computed.
    resamples: u32,
    ruleset: String,
    seed: Option<String>,
    /// BLAKE3 of the dataset's archive.
    dataset_blake3: Option<String>,
    finished_at: Timestamp,
    tasks: Vec<TaskFigures>,
    /// Evaluations of other teams on the same episodes.
    comparable: Vec<OtherEvaluation>,
    timing: Option<TimingFigures>,
    /// Chart of answer times; once the day is released.
    answer_times: Option<AnswerTimeChart>,
    slow_answers: SlowAnswers,
}

/// Another team's evaluation on the same episodes.
struct OtherEvaluation {
    team: String,
    evaluation: EvaluationId,
    score: String,
}

/// Formatted delays caused by the server: the *noise floor*, which every answer has, and *host interference*, single delays by other load
/// on the machine.
struct TimingFigures {
    /// Round trips measured before the evaluation, and between its episodes.
    before: RoundTripFigures,
    during: RoundTripFigures,
    /// Longest delay by host interference; `None` if none was measured.
    max_host_interference_ms: Option<String>,
    /// Episodes repeated because of host interference.
    host_interference_reruns: u32,
    /// Restarts after a platform fault.
    platform_retries: u32,
}

/// Round trips to the calibration agent, a test agent that answers at once; in milliseconds.
struct RoundTripFigures {
    count: u32,
    p50_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TimingFigures {
    fn new(timing: &SlotTiming) -> Self {
        let figures = |trips: RoundTrips| RoundTripFigures {
            count: trips.count,
            p50_ms: format::precise_milliseconds(trips.p50),
            p99_ms: format::precise_milliseconds(trips.p99),
            max_ms: format::precise_milliseconds(trips.max),
        };
        Self {
            before: figures(timing.before_s),
            during: figures(timing.during_s),
            max_host_interference_ms: (timing.max_host_interference_s > 0.0)
                .then(|| format::milliseconds(timing.max_host_interference_s)),
            host_interference_reruns: timing.host_interference_reruns,
            platform_retries: timing.platform_retries,
        }
    }
}

#[derive(Template)]
#[template(path = "evaluation.html")]
struct Page {
    frame: Frame,
    /// Heading and points of each kind of violation.
    violation_headers: Vec<format::ViolationHeader>,
    id: EvaluationId,
    team: String,
    agent: Option<String>,
    voided: Option<DecisionView>,
    extra_evaluation: Option<String>,
    is_rerun_after_release: bool,
    day: civil::Date,
    profile: Profile,
    /// Path of the ablation of the submission, if there is one.
    ablation: Option<String>,
    /// Are episodes and replays visible?
    has_episodes: bool,
    has_replays: bool,
    /// The state of the evaluation as text, in place of a result.
    state: String,
    is_dataset_public: bool,
    dataset_removed: Option<DecisionView>,
    progress: Option<Progress>,
    queue: Option<QueueView>,
    /// What happens next, as a sentence.
    next_step: String,
    result: Option<FinalResult>,
}

impl Page {
    /// Text for screen readers after a live update.
    fn live_text(&self) -> String {
        match &self.result {
            Some(result) => format!(
                "The evaluation of {} is finished: score {} percent, {} penalty points.",
                self.team, result.score.percent, result.penalty_points
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
    let visibility = Visibility::load(&app, viewer?).await?;
    let view = evaluation::find(&app, &visibility, id).await?;
    let submission = submission::find(&app, view.submission).await?;
    let ablation = ablation::exists(&app, submission.id).await?;
    let scored_at = view.status.finished_at();
    // The freeze of the boards that hides the result, because the evaluation finished after it.
    let frozen = scored_at.and_then(|scored_at| visibility.hiding_freeze(view.stage, scored_at));
    let clips = Clips::find(&app, &visibility, id).await.ok();
    let distributions = match &clips {
        Some(clips) => clips.computation_times().await?,
        None => TaskMap::new(),
    };
    let final_result = match &view.status {
        _ if frozen.is_some() => None,
        EvaluationStatus::Finished {
            finished_at,
            result: Some(result),
            dataset_blake3,
            ..
        } => {
            let summary = evaluation::summary(&view, &app).await?;
            let comparable = match view.released_at {
                Some(_) => comparable_evaluations(&app, &visibility, &view, result.seed).await?,
                None => Vec::new(),
            };
            Some(FinalResult {
                dataset_blake3: dataset_blake3.clone(),
                comparable,
                slow_answers: SlowAnswers::load(&app, &view, result).await?,
                answer_times: answer_times(result, &distributions),
                ..FinalResult::new(result, *finished_at, &summary, app.config.competition())
            })
        }
        _ => None,
    };
    render(&Page {
        violation_headers: format::violation_headers(app.config.competition()),
        frame: Frame::load(&app, NO_ENTRY)
            .await?
            .with_address(&app, &format!("/evaluations/{id}"))
            .with_card(
                &app,
                &format!("/evaluations/{id}/card.png"),
                format!(
                    "{} on {}: score and success by task",
                    view.team_name, view.day
                ),
            ),
        id,
        team: view.team_name.to_string(),
        agent: submission.agent_name,
        voided: view.voided.clone(),
        extra_evaluation: view.extra_evaluation.clone(),
        is_rerun_after_release: view.rerun_after_release,
        day: view.day,
        profile: view.profile,
        has_episodes: clips.is_some(),
        has_replays: clips.is_some() && app.config.competition().has_replays,
        ablation: ablation.then(|| format!("/submissions/{}/ablation", submission.id)),
        state: match frozen {
            Some(frozen) => format!(
                "Finished. The boards of this stage are frozen since {} ({}); the result is shown when they are unfrozen.",
                utc_minute(frozen.at),
                frozen.reason
            ),
            None => state_text(&view).to_owned(),
        },
        is_dataset_public: view.public,
        dataset_removed: view.dataset_removed.clone(),
        progress: (!view.status.is_final()).then_some(view.progress),
        queue: view.queue,
        next_step: view.next.clone(),
        result: final_result,
    })
}

/// State of an evaluation without a visible result.
const fn state_text(view: &EvaluationView) -> &'static str {
    const HIDDEN: &str = "Finished. The stage is blind: results are hidden from everyone, teams included, until the \
                          organisers reveal them. No date is set.";
    match &view.status {
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. } if view.blind => {
            HIDDEN
        }
        EvaluationStatus::Queued => {
            "Waiting for a free slot, a place in which a machine runs one agent at a time."
        }
        EvaluationStatus::Running => "Running.",
        EvaluationStatus::Scoring => "All episodes have been played; the score is being computed.",
        EvaluationStatus::Finished { .. } => "",
        EvaluationStatus::AgentFailed { .. } => {
            "The agent was stopped because it violated the protocol or a limit too often. There is no score. The team sees \
             faults and log when the day is released."
        }
        EvaluationStatus::PlatformFailed { .. } => {
            "Stopped by a fault of this server, not of the agent. The evaluation is repeated with the same agent on the \
             same episodes, unless the fault persists."
        }
        EvaluationStatus::DeadlineMissed { .. } => {
            "Not finished before the deadline of the day, because the server ran out of time, not because of the agent."
        }
        EvaluationStatus::Cancelled { .. } => "Cancelled by the organisers.",
    }
}

/// Finished evaluations on the same episodes, best score first.
async fn comparable_evaluations(
    app: &App,
    visibility: &Visibility,
    evaluation: &EvaluationView,
    seed: Option<Seed>,
) -> Result<Vec<OtherEvaluation>, PageProblem> {
    let may_have_same_episodes = |other: &EvaluationView| {
        other.id != evaluation.id
            && other.voided.is_none()
            && other.profile == evaluation.profile
            && other.episodes_per_task == evaluation.episodes_per_task
            && other.tasks == evaluation.tasks
    };
    let day = StageDay {
        stage: evaluation.stage,
        date: evaluation.day,
    };
    let same_day = evaluation::day_evaluations(app, visibility, day).await?;
    let mut comparable = Vec::new();
    let is_shown = |view: &EvaluationView| {
        let scored_at = view.status.finished_at();
        scored_at.is_none_or(|scored_at| visibility.hiding_freeze(view.stage, scored_at).is_none())
    };
    let candidates = same_day.into_iter().filter(may_have_same_episodes);
    let shown = candidates.filter(is_shown);
    for view in shown {
        // The seed decides, since an extra evaluation may have other episodes.
        if let EvaluationStatus::Finished {
            result: Some(result),
            ..
        } = view.status
            && result.seed == seed
        {
            comparable.push((result.score, view.team_name, view.id));
        }
    }
    comparable.sort_by(|(a_score, _, a_id), (b_score, _, b_id)| {
        b_score.total_cmp(a_score).then_with(|| a_id.cmp(b_id))
    });
    Ok(comparable
        .into_iter()
        .map(|(score, team, evaluation)| OtherEvaluation {
            team: team.to_string(),
            evaluation,
            score: format::one_decimal(score),
        })
        .collect())
}

/// Number of control steps by answer time.
type Distributions = TaskMap<Vec<TimeBinView>>;

/// Chart of the answer times of all tasks; `None` before the day is released. A task has bars of its distribution only if the viewer may
/// see its clips.
fn answer_times(result: &ResultView, distributions: &Distributions) -> Option<AnswerTimeChart> {
    let tasks = result.tasks.iter();
    let summaries: Vec<TimeSummary> = tasks
        .filter_map(|(task, result)| {
            let time = result.computation_time_s?;
            Some(TimeSummary {
                name: task.to_string(),
                mean: 1e3 * time.mean,
                p99: 1e3 * time.p99,
                max: 1e3 * time.max,
                bins: distributions
                    .get(task)
                    .map(|bins| time_bins(bins))
                    .unwrap_or_default(),
            })
        })
        .collect();
    let noise_floor = result.timing.as_ref().map(|timing| {
        let trips = timing.during_s;
        [1e3 * trips.p50, 1e3 * trips.p99]
    });
    (!summaries.is_empty()).then(|| AnswerTimeChart::new(&summaries, noise_floor))
}

fn time_bins(bins: &[TimeBinView]) -> Vec<TimeBin> {
    let bins = bins.iter().map(|bin| TimeBin {
        from: 1e3 * bin.from_s,
        to: 1e3 * bin.to_s,
        count: bin.steps,
    });
    bins.collect()
}

impl FinalResult {
    fn has_violations(&self) -> bool {
        let details = self.tasks.iter().filter_map(|task| task.details.as_ref());
        let mut kinds = details.flat_map(|details| &details.violations);
        kinds.any(|kind| kind.points.is_some())
    }

    fn new(
        result: &ResultView,
        finished_at: Timestamp,
        summary: &EpisodeSummary,
        competition: &Competition,
    ) -> Self {
        let weights = competition.weights(&result.variation);
        Self {
            score: Rate::of_score(result.score, &result.tasks, &weights),
            penalty_points: format::one_decimal(result.penalty_points),
            tier: result
                .tier
                .zip(competition.tier_bounds(&result.variation))
                .map(|(tier, bounds)| TierLabel::new(tier, &bounds)),
            tier_change: tier_change(summary, None),
            resamples: TIER_CHANGE_RESAMPLES,
            ruleset: result.ruleset.clone(),
            seed: result.seed.map(|seed| seed.to_string()),
            finished_at,
            tasks: result
                .tasks
                .iter()
                .map(|(task, result)| TaskFigures::new(*task, result, summary, competition))
                .collect(),
            dataset_blake3: None,
            comparable: Vec::new(),
            slow_answers: SlowAnswers::default(),
            timing: result.timing.as_ref().map(TimingFigures::new),
            answer_times: None,
        }
    }
}

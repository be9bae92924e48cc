//! The boards: `/` in tiers as in the paper's qualifying table, `/tasks/{task}` by task.

use super::{Frame, PageProblem, figures, render};
use crate::{
    App,
    api::{
        board::{BoardLine, ranked},
        evaluations::{EvaluationStatus, Progress, with_names},
    },
    extract::PathParam,
    problem::Problem,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_store::Evaluation;
use faceoff_types::{EvaluationId, Task, TaskResult, Tier, ViolationCounts};
use figures::Rate;
use jiff::civil;

/// Who a row is about.
struct Who {
    rank: u32,
    /// Whom the episodes cannot tell from the group's first.
    rank_group: u32,
    /// Of the tier on this board.
    tier_change: String,
    team: String,
    agent: Option<String>,
    evaluation: EvaluationId,
    day: civil::Date,
    /// How it was evaluated, where the rows of the board differ in that.
    setting: Option<String>,
}

/// How a result came about; results of different settings do not compare.
fn setting(line: &BoardLine) -> String {
    let result = &line.ranked.entry.result;
    let episodes = result
        .tasks
        .values()
        .map(|task| task.episodes)
        .max()
        .unwrap_or(0);
    format!(
        "{} profile, {episodes} episodes per task, rules {}",
        result.profile, result.ruleset
    )
}

/// The setting of the whole board; `None` where its rows differ.
fn common_setting(lines: &[BoardLine]) -> Option<String> {
    let first = setting(lines.first()?);
    lines
        .iter()
        .all(|line| setting(line) == first)
        .then_some(first)
}

impl Who {
    fn of(line: &BoardLine, common_setting: Option<&String>) -> Self {
        let record = &line.ranked.entry.key;
        Self {
            rank: line.ranked.rank,
            rank_group: line.rank_group,
            tier_change: figures::chance(line.tier_change),
            team: record.team.name.to_string(),
            agent: record.agent_name.clone(),
            evaluation: record.evaluation,
            day: record.day,
            setting: common_setting.is_none().then(|| setting(line)),
        }
    }
}

/// The teams of one tier; tiers without a team are left out.
struct TierRows<Row> {
    name: &'static str,
    title: &'static str,
    sign: &'static str,
    bounds: &'static str,
    rows: Vec<Row>,
}

fn by_tier<Row>(lines: &[BoardLine], row: impl Fn(&BoardLine) -> Row) -> Vec<TierRows<Row>> {
    let mut tiers: Vec<TierRows<Row>> = Tier::ALL
        .into_iter()
        .map(|tier| TierRows {
            name: tier.as_str(),
            title: tier.title(),
            sign: figures::tier_sign(tier),
            bounds: figures::tier_bounds(tier),
            rows: Vec::new(),
        })
        .collect();
    for line in lines {
        let tier = line.ranked.tier as usize;
        tiers[tier].rows.push(row(line));
    }
    tiers.retain(|tier| !tier.rows.is_empty());
    tiers
}

struct OverallRow {
    who: Who,
    /// In the order of `Task::ALL`; `None` where the task was not played.
    rates: Vec<(Task, Option<Rate>)>,
    penalty_points: String,
    per_episode: String,
    score: String,
}

impl OverallRow {
    fn of(line: &BoardLine, common_setting: Option<&String>) -> Self {
        let result = &line.ranked.entry.result;
        let episodes = result
            .tasks
            .values()
            .map(|task| task.episodes)
            .max()
            .unwrap_or(0);
        Self {
            who: Who::of(line, common_setting),
            rates: Task::ALL
                .into_iter()
                .map(|task| (task, result.tasks.get(&task).map(Rate::of)))
                .collect(),
            penalty_points: figures::one(result.penalty_points),
            per_episode: figures::per_episode(result.penalty_points, episodes),
            score: figures::one(result.score),
        }
    }
}

/// An evaluation of today that has no result (yet).
struct UnderWay {
    team: String,
    evaluation: EvaluationId,
    state: &'static str,
    progress: Option<Progress>,
}

#[derive(Template)]
#[template(path = "board.html")]
struct OverallPage {
    frame: Frame,
    today: civil::Date,
    daily_at: Option<String>,
    commitment: String,
    setting: Option<String>,
    tiers: Vec<TierRows<OverallRow>>,
    under_way: Vec<UnderWay>,
}

/// The overall board.
pub(super) async fn overall(State(app): State<App>) -> Result<Response, PageProblem> {
    let season = app.store.season().await?;
    let today = app.config.clock.today();
    let lines = ranked(&app, None).await?;
    let setting = common_setting(&lines);
    let page = OverallPage {
        frame: Frame::new(season.name, "/"),
        today,
        daily_at: app
            .config
            .daily_at
            .map(|at| at.strftime("%H:%M").to_string()),
        commitment: season.commitment,
        tiers: by_tier(&lines, |line| OverallRow::of(line, setting.as_ref())),
        setting,
        under_way: under_way(&app, today).await?,
    };
    render(&page)
}

async fn under_way(app: &App, today: civil::Date) -> Result<Vec<UnderWay>, PageProblem> {
    // A run that began before midnight may still be going.
    let mut evaluations: Vec<Evaluation> = match today.yesterday() {
        Ok(yesterday) => app.store.evaluations_on(yesterday).await?,
        Err(_) => Vec::new(),
    };
    evaluations.retain(|evaluation| !evaluation.state.is_over());
    evaluations.extend(app.store.evaluations_on(today).await?);
    let views = with_names(app, evaluations).await?;
    Ok(views
        .into_iter()
        .filter_map(|view| {
            let (state, moving) = match view.status {
                EvaluationStatus::Finished { .. } => return None,
                EvaluationStatus::Queued => ("Queued", true),
                EvaluationStatus::Running => ("Running", true),
                EvaluationStatus::Finalising => ("Computing the score", true),
                EvaluationStatus::AgentFailed { .. } => {
                    ("The agent failed; its team sees why", false)
                }
                EvaluationStatus::PlatformFailed { .. } => {
                    ("Stopped by our fault; the turn was given back", false)
                }
                EvaluationStatus::Cancelled { .. } => ("Cancelled by the organiser", false),
            };
            Some(UnderWay {
                team: view.team_name.to_string(),
                evaluation: view.id,
                state,
                progress: moving.then_some(view.progress),
            })
        })
        .collect())
}

struct TaskRow {
    who: Who,
    rate: Rate,
    penalty_points: String,
    per_episode: String,
    violations: ViolationCounts,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TaskRow {
    fn of(line: &BoardLine, result: &TaskResult, common_setting: Option<&String>) -> Self {
        let time = result.computation_time_s;
        Self {
            who: Who::of(line, common_setting),
            rate: Rate::of(result),
            penalty_points: figures::one(result.penalty_points),
            per_episode: figures::per_episode(result.penalty_points, result.episodes),
            violations: result.violations,
            mean_ms: figures::milliseconds(time.mean),
            p99_ms: figures::milliseconds(time.p99),
            max_ms: figures::milliseconds(time.max),
        }
    }
}

#[derive(Template)]
#[template(path = "task.html")]
struct TaskPage {
    frame: Frame,
    title: &'static str,
    aim: &'static str,
    setting: Option<String>,
    tiers: Vec<TierRows<TaskRow>>,
}

/// The board of one task.
pub(super) async fn by_task(
    State(app): State<App>,
    task: Result<PathParam<Task>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(task) = task?;
    let season = app.store.season().await?;
    let (title, aim) = match task {
        Task::Hit => (
            "Hit",
            "Score a goal against an opponent that moves in a fixed pattern.",
        ),
        Task::Defend => (
            "Defend",
            "Stop an incoming puck on the own side of the table.",
        ),
        Task::Prepare => (
            "Prepare",
            "Bring a puck from the border to a good hitting position.",
        ),
    };
    let mut lines = ranked(&app, Some(task)).await?;
    // `task_board` leaves out teams without the task; a row without one could show nothing.
    lines.retain(|line| line.ranked.entry.result.tasks.contains_key(&task));
    let setting = common_setting(&lines);
    let tiers = by_tier(&lines, |line| {
        let result = &line.ranked.entry.result.tasks[&task];
        TaskRow::of(line, result, setting.as_ref())
    });
    let frame = Frame::new(season.name, format!("/tasks/{task}"));
    render(&TaskPage {
        frame,
        title,
        aim,
        setting,
        tiers,
    })
}

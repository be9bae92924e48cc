//! `/evaluations/{a}/compare/{b}`: the evaluations of two teams on the same episodes, with a test whether their difference is more than
//! chance.

pub(super) mod pair;

use super::{
    format,
    frame::{Frame, NO_ENTRY, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::{requests::ComparisonQuery, views::comparison::ComparisonView};
use faceoff_scoring::SolvedEpisodes;
use faceoff_service::{
    app::App,
    extract::PathParams,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, comparison, visibility::Visibility},
};
use faceoff_types::{EvaluationId, Task};

/// A difference with its interval and significance test.
struct Difference {
    value: String,
    low: String,
    high: String,
    p_value: String,
    /// Which team is ahead, if the difference is significant.
    verdict: String,
}

impl Difference {
    /// Values in percentage points.
    fn new(value: f64, ci95: [f64; 2], p: f64, is_significant: bool, names: [&str; 2]) -> Self {
        Self {
            value: format::signed(value),
            low: format::signed(ci95[0]),
            high: format::signed(ci95[1]),
            p_value: format::p_value(p),
            verdict: match (is_significant, value > 0.0) {
                (false, _) => "statistically tied".to_owned(),
                (true, true) => format!("{} is ahead", names[0]),
                (true, false) => format!("{} is ahead", names[1]),
            },
        }
    }
}

/// Results of both teams in a task.
struct Row {
    task: String,
    /// Number of episodes that both teams solved; in the next fields only the first, only the second, or neither.
    both: u32,
    only_a: u32,
    only_b: u32,
    neither: u32,
    rate_a: String,
    rate_b: String,
    difference: Difference,
}

/// Episodes of a task that only one of the two teams solved.
struct DifferingEpisodes {
    task: Task,
    /// For each team: its name, and the episodes that only this team solved.
    sides: [(String, Vec<u32>); 2],
}

impl DifferingEpisodes {
    /// Tasks without such episodes are omitted.
    fn by_task(view: &ComparisonView) -> Vec<Self> {
        let task_episodes = |(task, solved): (&Task, &SolvedEpisodes)| Self {
            task: *task,
            sides: [
                (view.a.team.to_string(), solved.only_a.clone()),
                (view.b.team.to_string(), solved.only_b.clone()),
            ],
        };
        let all_tasks = view.episodes.iter().flatten().map(task_episodes);
        all_tasks
            .filter(|task| task.sides.iter().any(|(_, episodes)| !episodes.is_empty()))
            .collect()
    }
}

#[derive(Template)]
#[template(path = "comparison.html")]
struct Page {
    frame: Frame,
    view: ComparisonView,
    rows: Vec<Row>,
    score_a: String,
    score_b: String,
    overall: Difference,
    differing: Vec<DifferingEpisodes>,
    /// Are replays available for both?
    has_replays: bool,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    ids: Result<PathParams<EvaluationId, 2>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParams(ids) = ids?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let view =
        comparison::compare(&app, &visibility, ids, ComparisonQuery { episodes: true }).await?;
    let mut has_replays = app.config.competition().has_replays;
    for id in ids {
        has_replays &= Clips::find(&app, &visibility, id).await.is_ok();
    }
    let names = [view.a.team.as_str(), view.b.team.as_str()];
    let rows = view
        .tasks
        .iter()
        .map(|(task, comparison)| Row {
            task: task.to_string(),
            both: comparison.both,
            only_a: comparison.only_a,
            only_b: comparison.only_b,
            neither: comparison.neither,
            rate_a: format::one_decimal(100.0 * comparison.success_rate_a),
            rate_b: format::one_decimal(100.0 * comparison.success_rate_b),
            difference: Difference::new(
                100.0 * comparison.difference,
                comparison.difference_ci95.map(|bound| 100.0 * bound),
                comparison.p_value,
                comparison.significant,
                names,
            ),
        })
        .collect();
    let overall = &view.overall;
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY).await?,
        rows,
        score_a: format::one_decimal(overall.score_a),
        score_b: format::one_decimal(overall.score_b),
        overall: Difference::new(
            overall.difference,
            overall.difference_ci95,
            overall.p_value,
            overall.significant,
            names,
        ),
        differing: DifferingEpisodes::by_task(&view),
        has_replays,
        view,
    })
}

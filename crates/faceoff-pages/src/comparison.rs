//! `/evaluations/{a}/compare/{b}`: two evaluations on the same episodes.

pub(super) mod pair;

use super::{
    figures,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::{requests::ComparisonQuery, views::comparison::ComparisonView};
use faceoff_scoring::WhoSolved;
use faceoff_service::{
    app::App,
    extract::PathParams,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, comparison, season::SeasonHead, sight::Sight},
};
use faceoff_types::{EvaluationId, Task};

/// A difference with its interval and its test.
struct Difference {
    value: String,
    low: String,
    high: String,
    p_value: String,
    /// In words: who is ahead, if anyone can be told to be.
    verdict: String,
}

impl Difference {
    /// In percentage points; `names` are the two teams'.
    fn of(value: f64, ci95: [f64; 2], p: f64, told_apart: bool, names: [&str; 2]) -> Self {
        Self {
            value: figures::signed(value),
            low: figures::signed(ci95[0]),
            high: figures::signed(ci95[1]),
            p_value: figures::p_value(p),
            verdict: match (told_apart, value > 0.0) {
                (false, _) => "not told apart".to_owned(),
                (true, true) => format!("{} is ahead", names[0]),
                (true, false) => format!("{} is ahead", names[1]),
            },
        }
    }
}

struct Row {
    task: String,
    both: u32,
    only_a: u32,
    only_b: u32,
    neither: u32,
    rate_a: String,
    rate_b: String,
    difference: Difference,
}

/// The episodes of a task that one of the two alone solved.
struct Differing {
    task: Task,
    sides: [(String, Vec<u32>); 2],
}

impl Differing {
    /// Tasks without any are left out.
    fn of(view: &ComparisonView) -> Vec<Self> {
        let of_task = |(task, who): (&Task, &WhoSolved)| Self {
            task: *task,
            sides: [
                (view.a.team.to_string(), who.only_a.clone()),
                (view.b.team.to_string(), who.only_b.clone()),
            ],
        };
        let all = view.episodes.iter().flatten().map(of_task);
        all.filter(|of| of.sides.iter().any(|(_, episodes)| !episodes.is_empty()))
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
    differing: Vec<Differing>,
    /// Can episodes be looked at side by side?
    has_replays: bool,
}

/// The comparison of two evaluations.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    ids: Result<PathParams<EvaluationId, 2>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParams(ids) = ids?;
    let sight = Sight::of(&app, viewer?).await?;
    let view = comparison::of(&app, &sight, ids, ComparisonQuery { episodes: true }).await?;
    let mut has_replays = true;
    for id in ids {
        has_replays &= Clips::of(&app, &sight, id).await.is_ok();
    }
    let season = SeasonHead::now(&app).await?;
    let names = [view.a.team.as_str(), view.b.team.as_str()];
    let rows = view
        .tasks
        .iter()
        .map(|(task, of)| Row {
            task: task.to_string(),
            both: of.both,
            only_a: of.only_a,
            only_b: of.only_b,
            neither: of.neither,
            rate_a: figures::one(100.0 * of.success_rate_a),
            rate_b: figures::one(100.0 * of.success_rate_b),
            difference: Difference::of(
                100.0 * of.difference,
                of.difference_ci95.map(|bound| 100.0 * bound),
                of.p_value,
                of.told_apart,
                names,
            ),
        })
        .collect();
    let of = &view.overall;
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        rows,
        score_a: figures::one(of.score_a),
        score_b: figures::one(of.score_b),
        overall: Difference::of(
            of.difference,
            of.difference_ci95,
            of.p_value,
            of.told_apart,
            names,
        ),
        differing: Differing::of(&view),
        has_replays,
        view,
    })
}

//! `/evaluations/{id}/episodes`: how each episode went and why, where they began, and where limits were broken.

mod maps;
mod rows;

use super::{
    assets,
    episode_words::end_word,
    frame::{Frame, PageProblem, render},
    table_drawing::Ground,
};
use crate::query::asking;
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::requests::EpisodesQuery;
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clips::Clips, season::SeasonHead, sight::Sight},
};
use faceoff_types::{EpisodeEnd, EvaluationId, Task};
use jiff::civil::Date;
use maps::{OutcomeMap, SafetyMap};
use rows::Row;

/// Episodes on a page.
const PER_PAGE: usize = 100;

/// A choice of a form's list.
struct Choice {
    value: &'static str,
    word: &'static str,
    chosen: bool,
}

#[derive(Template)]
#[template(path = "episodes.html")]
struct Page {
    frame: Frame,
    style: &'static str,
    id: EvaluationId,
    team: String,
    day: Date,
    /// Of all episodes of the evaluation.
    total: usize,
    /// Of those that were asked for.
    found: usize,
    failed: usize,
    sees_observed: bool,
    is_chosen: bool,
    tasks: Vec<Choice>,
    went: Vec<Choice>,
    broke: Vec<Choice>,
    ends: Vec<Choice>,
    ground: Ground,
    outcomes: Vec<OutcomeMap>,
    safety: SafetyMap,
    rows: Vec<Row>,
    /// The first and the last of `rows` among those found, from 1.
    from: usize,
    to: usize,
    newer: Option<String>,
    older: Option<String>,
}

/// The episodes of an evaluation.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
    query: Result<QueryParams<EpisodesQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let QueryParams(query) = query?;
    let chosen = query.chosen().map_err(|field| {
        let detail =
            format!("there is no such choice of {field:?}; choose on the page of the episodes");
        Problem::new(ProblemKind::InvalidRequest, detail)
    })?;
    let sight = Sight::of(&app, viewer?).await?;
    let clips = Clips::of(&app, &sight, id).await?;
    let view = clips.episodes().await?;
    let team = app
        .store
        .team(clips.evaluation.team)
        .await
        .map_err(Problem::from)?;
    let season = SeasonHead::now(&app).await?;

    let of_task: Vec<_> = view
        .episodes
        .iter()
        .filter(|line| chosen.task.is_none_or(|task| task == line.task))
        .collect();
    let found: Vec<_> = of_task
        .iter()
        .copied()
        .filter(|line| chosen.takes(line))
        .collect();
    let pages = found.len().div_ceil(PER_PAGE).max(1);
    let number = usize::try_from(query.page.unwrap_or(1)).unwrap_or(usize::MAX);
    let number = number.clamp(1, pages);
    let first = (number - 1) * PER_PAGE;
    let rows: Vec<Row> = found
        .iter()
        .skip(first)
        .take(PER_PAGE)
        .map(|line| Row::of(id, line))
        .collect();
    let other_page = |number: usize| {
        let query = EpisodesQuery {
            page: u32::try_from(number).ok(),
            ..query.clone()
        };
        let address = asking(&format!("/evaluations/{id}/episodes"), &query);
        format!("{address}#table")
    };
    let choice = |given: &str, value: &'static str, word: &'static str| Choice {
        value,
        word,
        chosen: given == value,
    };
    let is_played = |task: &Task| view.episodes.iter().any(|line| line.task == *task);
    let tasks = Task::ALL.into_iter().filter(is_played);
    let groups = [
        ("any", "any limit"),
        ("ee", "end effector"),
        ("link", "elbow, wrist"),
        ("joint_pos", "joint position"),
        ("joint_vel", "joint velocity"),
    ];
    let late = clips.sees_observed.then_some(("late", "a late answer"));
    let ends = [
        EpisodeEnd::Horizon,
        EpisodeEnd::LeftTable,
        EpisodeEnd::CrossedMiddle,
        EpisodeEnd::Stopped,
        EpisodeEnd::ReachedAxis,
        EpisodeEnd::AgentFault,
    ];
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        style: assets::EPISODES_STYLE.url(),
        id,
        team: team.name.to_string(),
        day: clips.evaluation.of.date,
        total: view.episodes.len(),
        found: found.len(),
        failed: found.iter().filter(|line| !line.success).count(),
        sees_observed: clips.sees_observed,
        is_chosen: query
            != EpisodesQuery {
                page: query.page,
                ..EpisodesQuery::default()
            },
        tasks: tasks
            .clone()
            .map(|task| choice(&query.task, task.as_str(), task.as_str()))
            .collect(),
        went: [("success", "success"), ("failure", "no success")]
            .map(|(value, word)| choice(&query.went, value, word))
            .into(),
        broke: groups
            .into_iter()
            .chain(late)
            .map(|(value, word)| choice(&query.broke, value, word))
            .collect(),
        ends: ends
            .map(|end| choice(&query.end, end.as_str(), end_word(end)))
            .into(),
        ground: Ground::new(),
        outcomes: tasks
            .filter_map(|task| OutcomeMap::of(task, &found))
            .collect(),
        safety: SafetyMap::of(&found),
        from: if rows.is_empty() { 0 } else { first + 1 },
        to: first + rows.len(),
        rows,
        newer: (number > 1).then(|| other_page(number - 1)),
        older: (number < pages).then(|| other_page(number + 1)),
    })
}

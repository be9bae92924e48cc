//! `/evaluations/{id}/episodes`: the episodes of an evaluation, which are single attempts at a task: their outcomes, start positions and
//! violations.

mod maps;
mod rows;
pub(super) mod still;

use super::{
    assets,
    frame::{Frame, NO_ENTRY, PageProblem, render},
    table_drawing::TableOutline,
};
use crate::query::with_query;
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::requests::{EpisodesQuery, ViolatedLimit};
use faceoff_replay::EpisodeIndexEntry;
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clips::Clips, visibility::Visibility},
};
use faceoff_types::{EvaluationId, Task};
use jiff::civil::Date;
use maps::{StartMap, ViolationMap};
use rows::Row;

/// Rows of the table per page.
const ROWS_PER_PAGE: usize = 100;

/// An option of a select box.
struct SelectOption {
    value: String,
    label: String,
    is_selected: bool,
}

#[derive(Template)]
#[template(path = "episodes.html")]
struct Page {
    frame: Frame,
    styles: [&'static str; 2],
    id: EvaluationId,
    team: String,
    day: Date,
    /// Number of episodes of the evaluation.
    total: usize,
    /// Number of episodes that match the filter.
    matching: usize,
    /// Number of matching episodes without success.
    failed: usize,
    /// May the viewer see observations and answer times of the agent?
    can_see_observations: bool,
    has_filter: bool,
    tasks: Vec<SelectOption>,
    outcomes: Vec<SelectOption>,
    violated: Vec<SelectOption>,
    ends: Vec<SelectOption>,
    /// Are positions on the table known? Only then are maps shown.
    has_table: bool,
    table: TableOutline,
    start_maps: Vec<StartMap>,
    violations: ViolationMap,
    rows: Vec<Row>,
    /// Numbers of the first and last row among the matching episodes, from 1.
    from: usize,
    to: usize,
    previous_page: Option<String>,
    next_page: Option<String>,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<EvaluationId>, Problem>,
    query: Result<QueryParams<EpisodesQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let QueryParams(query) = query?;
    let invalid = |field| {
        let detail =
            format!("unknown value of {field:?}; use the filter on the page of the episodes");
        Problem::new(ProblemKind::InvalidRequest, detail)
    };
    let filter = query.filter().map_err(invalid)?;
    let competition = app.config.competition();
    if let Some(task) = filter.task {
        let known = competition.find_task(task.as_str());
        known.map_err(|_| invalid("task"))?;
    }
    if let Some(ViolatedLimit::One(name)) = filter.violated
        && !competition.world_violations().any(|known| known == name)
    {
        return Err(invalid("violated").into());
    }
    let ends = &competition.ends;
    if let Some(end) = filter.end
        && !ends.iter().any(|info| info.end == end)
    {
        return Err(invalid("end").into());
    }
    let visibility = Visibility::load(&app, viewer?).await?;
    let clips = Clips::find(&app, &visibility, id).await?;
    let view = clips.episodes().await?;
    let team = app.store.team(clips.evaluation.team).await?;

    let task_episodes: Vec<_> = view
        .episodes
        .iter()
        .filter(|summary| filter.task.is_none_or(|task| task == summary.task))
        .collect();
    let matching: Vec<_> = task_episodes
        .iter()
        .copied()
        .filter(|summary| filter.matches(summary))
        .collect();
    let pages = matching.len().div_ceil(ROWS_PER_PAGE).max(1);
    let page = usize::try_from(query.page.unwrap_or(1)).unwrap_or(usize::MAX);
    let page = page.clamp(1, pages);
    let first_index = (page - 1) * ROWS_PER_PAGE;
    let still_version = still::version(&clips.file);
    let rows: Vec<Row> = matching
        .iter()
        .skip(first_index)
        .take(ROWS_PER_PAGE)
        .map(|summary| Row::new(competition, id, summary, &still_version))
        .collect();
    let other_page = |number: usize| {
        let query = EpisodesQuery {
            page: u32::try_from(number).ok(),
            ..query.clone()
        };
        let address = with_query(&format!("/evaluations/{id}/episodes"), &query);
        format!("{address}#table")
    };
    let option = |selected: &str, value: &str, label: &str| SelectOption {
        value: value.to_owned(),
        label: label.to_owned(),
        is_selected: selected == value,
    };
    let is_played = |task: &Task| view.episodes.iter().any(|summary| summary.task == *task);
    let tasks = competition.task_names().filter(is_played);
    let any_limit = ("any".to_owned(), "any limit".to_owned());
    let single_limits = competition
        .world_violations()
        .map(|name| (name.to_string(), competition.violation_title(name)));
    let late_answer = clips
        .can_see_observations
        .then(|| ("late".to_owned(), "a late answer".to_owned()));
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY).await?,
        styles: [
            assets::EPISODES_STYLE.url(),
            assets::EPISODE_LIST_STYLE.url(),
        ],
        id,
        team: team.name.to_string(),
        day: clips.evaluation.stage_day.date,
        total: view.episodes.len(),
        matching: matching.len(),
        failed: matching.iter().filter(|summary| !summary.success).count(),
        can_see_observations: clips.can_see_observations,
        has_filter: query
            != EpisodesQuery {
                page: query.page,
                ..EpisodesQuery::default()
            },
        tasks: tasks
            .clone()
            .map(|task| option(&query.task, task.as_str(), task.as_str()))
            .collect(),
        outcomes: [("success", "success"), ("failure", "no success")]
            .map(|(value, label)| option(&query.outcome, value, label))
            .into(),
        violated: std::iter::once(any_limit)
            .chain(single_limits)
            .chain(late_answer)
            .map(|(value, label)| option(&query.violated, &value, &label))
            .collect(),
        ends: ends
            .iter()
            .map(|info| option(&query.end, info.end.as_str(), &info.title))
            .collect(),
        has_table: view.episodes.is_empty()
            || view.episodes.iter().any(EpisodeIndexEntry::has_clips),
        table: TableOutline::new(),
        start_maps: tasks
            .filter_map(|task| StartMap::new(task, &matching))
            .collect(),
        violations: ViolationMap::new(&matching),
        from: if rows.is_empty() { 0 } else { first_index + 1 },
        to: first_index + rows.len(),
        rows,
        previous_page: (page > 1).then(|| other_page(page - 1)),
        next_page: (page < pages).then(|| other_page(page + 1)),
    })
}

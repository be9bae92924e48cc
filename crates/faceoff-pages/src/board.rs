//! The boards, the rankings of a stage: `/` over all tasks, `/tasks/{task}` by one task. Teams are grouped by *tier*, a safety class that
//! follows from penalty points: deployable, improvable or non-deployable.

mod address;
mod day_progress;
mod days;
pub(super) mod embedded;
mod front;
mod info;
mod rows;
mod score_history;
mod sort;

use super::{
    baselines::{self, Baseline},
    frame::{Frame, PageProblem, render_with_etag},
};
use crate::{assets, chart::TeamsChart, query::with_query};
use address::Address;
use askama::Template;
use axum::{extract::State, response::Response};
use day_progress::DayProgress;
use days::Days;
use faceoff_api::{
    requests::{BoardPageQuery, HistoryQuery},
    views::{board::BoardView, team::TeamView},
};
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{board, board_timeline::BoardTimeline, season::SeasonSummary, visibility::Visibility},
};
use faceoff_types::{Competition, Task};
use front::FrontPage;
use info::BoardInfo;
use rows::{Context, Group, OverallRow, TaskRow, common_conditions};
use score_history::ScoreHistory;
use sort::Sort;
use std::sync::Arc;

/// Interval at which `live.js` reloads the progress of running evaluations.
const POLL_SECONDS: u32 = 10;

#[derive(Template)]
#[template(path = "board.html")]
struct OverallPage {
    /// Short title of the competition, for the title of the page.
    competition: String,
    frame: Frame,
    board_info: BoardInfo,
    days: Days,
    sort: Sort,
    /// Profile, episodes and rules of all rows; `None` if rows differ.
    conditions: Option<String>,
    /// The earlier day to which changes of rank and score are relative.
    comparison_day: Option<jiff::civil::Date>,
    groups: Vec<Group<OverallRow>>,
    baselines: Vec<Baseline>,
    progress: DayProgress,
    disqualified: Vec<TeamView>,
    /// Above the newest board of the current stage with all teams; `None` above others.
    front: Option<FrontPage>,
    /// Text of the link preview that chats show.
    description: String,
    style: &'static str,
    score_history: Option<TeamsChart>,
    downloads: Downloads,
    /// BLAKE3 hash of the season's secret, from which all episodes are drawn.
    commitment: String,
}

/// Addresses of the shown board, and of its history, in other formats.
struct Downloads {
    /// The address of the board without a format; it ends with `?` or `&`.
    board: String,
    history: String,
}

impl Downloads {
    fn new(board: &BoardView, query: &BoardPageQuery) -> Self {
        let path = match board.task {
            Some(task) => format!("/api/v1/board/{task}"),
            None => "/api/v1/board".to_owned(),
        };
        let mut address = with_query(&path, &query.board());
        address.push(if address.contains('?') { '&' } else { '?' });
        Self {
            board: address,
            history: with_query(
                "/api/v1/board/history",
                &HistoryQuery {
                    stage: Some(board.stage),
                    revision: Some(board.revision),
                    division: board.division.clone(),
                    task: board.task,
                    ..HistoryQuery::default()
                },
            ),
        }
    }
}

impl OverallPage {
    /// Are the rows grouped by tier? Not if the table is sorted by another column, or the competition has no tiers.
    fn is_ranked_by_tier(&self) -> bool {
        self.groups.iter().any(|group| group.tier.is_some())
    }

    /// Text for screen readers after a live update.
    fn live_text(&self) -> String {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        live_text(rows.map(|row| (row.team.team.as_str(), row.score.percent.as_str())))
    }
}

/// What the page is about, for link previews: who leads, then what the competition is.
fn description(competition: &Competition, front: Option<&FrontPage>) -> String {
    let leader = front.and_then(|front| front.leader.as_ref());
    let leads = leader.map(|leader| format!("{} leads with {} %. ", leader.team, leader.score));
    format!("{}{}", leads.unwrap_or_default(), competition.summary)
}

/// `rows`: teams with their scores, in the order of the board.
fn live_text<'a>(mut rows: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let Some((first, percent)) = rows.next() else {
        return String::new();
    };
    let teams = 1 + rows.count();
    format!("The board has changed. Teams: {teams}. First in the list: {first}, {percent} percent.")
}

pub(super) async fn overall(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    query: Result<QueryParams<BoardPageQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(query) = query?;
    let address = Address::new("/", &query);
    let competition = Arc::clone(app.config.competition());
    let sort = Sort::new(&query, None, &address, &competition)?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let season = SeasonSummary::load(&app).await?;
    let mut board = board::query(&app, &visibility, query.board(), None).await?;
    sort.apply(&mut board.rows, None);
    let stage = app.store.stage(board.stage).await?;
    let today = stage.day(app.config.clock.now());
    let timeline = BoardTimeline::load(&app, &visibility, &board, query.live).await?;
    let days = Days::new(&board, &timeline, &address);
    let score_history =
        ScoreHistory::load(&app, &visibility, &board, (days.shown, query.live)).await?;
    let previous = timeline.previous_board.as_ref();
    let context = Context::new(&board, previous, &score_history, sort.is_by_rank());
    let groups = context.groups(|row| OverallRow::new(row, &context, &board.weights, &competition));
    let front = match query == BoardPageQuery::default() {
        true => {
            let takes_registrations = season.takes_registrations;
            let front =
                FrontPage::load(&app, &visibility, &board, &groups, takes_registrations).await?;
            Some(front)
        }
        false => None,
    };
    let page = OverallPage {
        description: description(&competition, front.as_ref()),
        front,
        style: assets::FRONT_STYLE.url(),
        score_history: score_history.chart(&board),
        downloads: Downloads::new(&board, &query),
        commitment: season.commitment,
        competition: competition.short_title.clone(),
        frame: match query == BoardPageQuery::default() {
            true => Frame::for_app(&app, season.name, "/").with_address(&app, "/"),
            false => Frame::for_app(&app, season.name, "/"),
        }
        .with_card(&app, &card_path("/card.png", &query), card_alt(&board)),
        board_info: BoardInfo::load(&app, &board, &visibility, &address, season.paused).await?,
        days,
        conditions: common_conditions(&board.rows),
        comparison_day: previous.map(|earlier| earlier.day),
        groups,
        baselines: baselines::rows(&board),
        progress: DayProgress::load(&app, &visibility, today, board.division.as_ref()).await?,
        disqualified: board.disqualified.clone(),
        sort,
    };
    render_with_etag(&page)
}

/// Path of the picture for link previews of the board. It shows what visitors see, so it never includes results after a freeze.
fn card_path(path: &str, query: &BoardPageQuery) -> String {
    let query = BoardPageQuery {
        live: false,
        sort: None,
        ..query.clone()
    };
    with_query(path, &query)
}

/// Text in place of the picture of the link preview.
fn card_alt(board: &BoardView) -> String {
    format!(
        "The first teams of {}: rank, score and its interval",
        board.stage_name
    )
}

#[derive(Template)]
#[template(path = "task.html")]
struct TaskPage {
    frame: Frame,
    board_info: BoardInfo,
    days: Days,
    sort: Sort,
    title: String,
    /// Aim of the task in one sentence.
    aim: String,
    /// Elements of an SVG drawing; empty without one.
    drawing: String,
    /// BLAKE3 hash of the season's secret, from which all episodes are drawn.
    commitment: String,
    styles: [&'static str; 2],
    score_history: Option<TeamsChart>,
    downloads: Downloads,
    /// Profile, episodes and rules of all rows; `None` if rows differ.
    conditions: Option<String>,
    /// The earlier day to which changes are relative.
    comparison_day: Option<jiff::civil::Date>,
    /// Headings of the columns of violations.
    violation_columns: Vec<String>,
    groups: Vec<Group<TaskRow>>,
    baselines: Vec<Baseline>,
}

impl TaskPage {
    /// Text for screen readers after a live update.
    fn live_text(&self) -> String {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        live_text(rows.map(|row| (row.team.team.as_str(), row.rate.percent.as_str())))
    }
}

/// The board of one task.
pub(super) async fn by_task(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    task: Result<PathParam<Task>, Problem>,
    query: Result<QueryParams<BoardPageQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(task), QueryParams(query)) = (task?, query?);
    let path = format!("/tasks/{task}");
    let address = Address::new(&path, &query);
    let competition = Arc::clone(app.config.competition());
    let sort = Sort::new(&query, Some(task), &address, &competition)?;
    let info = competition
        .task(task)
        .ok_or_else(|| board::unknown_task(&competition, task))?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let season = SeasonSummary::load(&app).await?;
    let mut board = board::query(&app, &visibility, query.board(), Some(task)).await?;
    // The board excludes teams without a result in this task.
    board.rows.retain(|row| row.tasks.contains_key(&task));
    sort.apply(&mut board.rows, Some(task));
    let timeline = BoardTimeline::load(&app, &visibility, &board, query.live).await?;
    let days = Days::new(&board, &timeline, &address);
    let score_history =
        ScoreHistory::load(&app, &visibility, &board, (days.shown, query.live)).await?;
    let previous = timeline.previous_board.as_ref();
    let context = Context::new(&board, previous, &score_history, sort.is_by_rank());
    render_with_etag(&TaskPage {
        styles: [assets::FRONT_STYLE.url(), assets::TASK_BOARD_STYLE.url()],
        score_history: score_history.chart(&board),
        downloads: Downloads::new(&board, &query),
        commitment: season.commitment,
        drawing: info.drawing.clone(),
        frame: Frame::for_app(&app, season.name, path.clone()).with_card(
            &app,
            &card_path(&format!("{path}/card.png"), &query),
            card_alt(&board),
        ),
        board_info: BoardInfo::load(&app, &board, &visibility, &address, season.paused).await?,
        days,
        title: info.title.clone(),
        aim: info.aim.clone(),
        conditions: common_conditions(&board.rows),
        comparison_day: previous.map(|earlier| earlier.day),
        violation_columns: competition
            .violations
            .iter()
            .map(|info| info.column_heading.clone())
            .collect(),
        groups: context.groups(|row| TaskRow::new(row, &row.tasks[&task], &context, &competition)),
        baselines: baselines::rows(&board),
        sort,
    })
}

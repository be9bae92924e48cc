//! The boards: `/` in tiers as in the paper's qualifying table, `/tasks/{task}` by task.

mod address;
mod days;
mod heading;
mod order;
mod rows;
mod under_way;

use super::{
    baselines::{self, Baseline},
    frame::{Frame, PageProblem, render_tagged},
};
use address::Address;
use askama::Template;
use axum::{extract::State, response::Response};
use days::Days;
use faceoff_api::{requests::BoardPageQuery, views::team::TeamView};
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{board, season::SeasonHead, sight::Sight, trail::Trail},
};
use faceoff_types::Task;
use heading::Heading;
use order::Order;
use rows::{Context, Group, OverallRow, TaskRow, common_setting};
use under_way::UnderWay;

/// Seconds between two looks at what is being played, of a page that is kept as it is on the server.
const LOOK_SECONDS: u32 = 10;

#[derive(Template)]
#[template(path = "board.html")]
struct OverallPage {
    frame: Frame,
    heading: Heading,
    days: Days,
    order: Order,
    commitment: String,
    setting: Option<String>,
    /// The day that changes are told since.
    since: Option<jiff::civil::Date>,
    has_groups: bool,
    groups: Vec<Group<OverallRow>>,
    baselines: Vec<Baseline>,
    under_way: UnderWay,
    disqualified: Vec<TeamView>,
}

impl OverallPage {
    /// What has changed when the board has, in a sentence.
    fn told(&self) -> String {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        told(rows.map(|row| (row.who.team.as_str(), row.score.percent.as_str())))
    }
}

/// Of teams and their scores, as they stand in the list.
fn told<'a>(mut rows: impl Iterator<Item = (&'a str, &'a str)>) -> String {
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
    let address = Address::of("/", &query);
    let order = Order::of(&query, None, &address)?;
    let sight = Sight::of(&app, viewer?).await?;
    let season = SeasonHead::now(&app).await?;
    let mut board = board::asked(&app, &sight, query.board(), None).await?;
    order.apply(&mut board.rows, None);
    let today = app.store.stage(board.stage).await.map_err(Problem::from)?;
    let today = today.day(app.config.clock.now());
    let trail = Trail::of(&app, &sight, &board, query.live).await?;
    let context = Context::of(&board, trail.before.as_ref(), order.is_usual());
    let page = OverallPage {
        frame: Frame::of(&app, season.name, "/"),
        heading: Heading::of(&app, &board, &sight, &address, season.paused).await?,
        days: Days::of(&board, &trail, &address),
        commitment: season.commitment,
        setting: common_setting(&board.rows),
        since: trail.before.as_ref().map(|before| before.day),
        has_groups: context.has_groups(),
        groups: context.groups(|row| OverallRow::of(row, &context, &board.weights)),
        baselines: baselines::of(&board),
        under_way: UnderWay::of(&app, &sight, today, board.division.as_ref()).await?,
        disqualified: board.disqualified.clone(),
        order,
    };
    render_tagged(&page)
}

#[derive(Template)]
#[template(path = "task.html")]
struct TaskPage {
    frame: Frame,
    heading: Heading,
    days: Days,
    order: Order,
    title: &'static str,
    aim: &'static str,
    setting: Option<String>,
    since: Option<jiff::civil::Date>,
    has_groups: bool,
    groups: Vec<Group<TaskRow>>,
    baselines: Vec<Baseline>,
}

impl TaskPage {
    /// What has changed when the board has, in a sentence.
    fn told(&self) -> String {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        told(rows.map(|row| (row.who.team.as_str(), row.rate.percent.as_str())))
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
    let address = Address::of(&path, &query);
    let order = Order::of(&query, Some(task), &address)?;
    let sight = Sight::of(&app, viewer?).await?;
    let season = SeasonHead::now(&app).await?;
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
    let mut board = board::asked(&app, &sight, query.board(), Some(task)).await?;
    // The board leaves out teams without the task; a row without one could show nothing.
    board.rows.retain(|row| row.tasks.contains_key(&task));
    order.apply(&mut board.rows, Some(task));
    let trail = Trail::of(&app, &sight, &board, query.live).await?;
    let context = Context::of(&board, trail.before.as_ref(), order.is_usual());
    render_tagged(&TaskPage {
        frame: Frame::of(&app, season.name, path.clone()),
        heading: Heading::of(&app, &board, &sight, &address, season.paused).await?,
        days: Days::of(&board, &trail, &address),
        title,
        aim,
        setting: common_setting(&board.rows),
        since: trail.before.as_ref().map(|before| before.day),
        has_groups: context.has_groups(),
        groups: context.groups(|row| TaskRow::of(row, &row.tasks[&task], &context)),
        baselines: baselines::of(&board),
        order,
    })
}

//! Cards of the boards: the first teams.

use super::{
    layout::{Card, LEFT, PercentWithInterval, RIGHT, legible, text_style, tier_style},
    response::respond,
};
use crate::{board_status::shared_rank, frame::PageProblem};
use axum::{extract::State, response::Response};
use faceoff_api::{requests::BoardPageQuery, views::board::BoardView};
use faceoff_picture::Weight;
use faceoff_service::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{board, visibility::Visibility},
};
use faceoff_types::Task;

const MAX_TEAMS: usize = 5;
/// Baseline of the first row, and the distance between rows.
const FIRST_ROW: f64 = 254.0;
const ROW_HEIGHT: f64 = 80.0;
/// Left end of the names.
const NAMES_LEFT: f64 = 150.0;
const NAME_WIDTH: f64 = 380.0;

type BoardQueryParams = Result<QueryParams<BoardPageQuery>, Problem>;

pub(super) async fn overall(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    query: BoardQueryParams,
) -> Result<Response, PageProblem> {
    respond(&app, &preconditions, load(&app, query?.0, None)).await
}

pub(super) async fn by_task(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    task: Result<PathParam<Task>, Problem>,
    query: BoardQueryParams,
) -> Result<Response, PageProblem> {
    let PathParam(task) = task?;
    respond(&app, &preconditions, load(&app, query?.0, Some(task))).await
}

async fn load(app: &App, query: BoardPageQuery, task: Option<Task>) -> Result<Card, PageProblem> {
    let visibility = Visibility::load(app, Viewer::Visitor).await?;
    let mut board = board::query(app, &visibility, query.board(), task).await?;
    // The board of a task excludes teams without a result in it.
    board
        .rows
        .retain(|row| task.is_none_or(|task| row.tasks.contains_key(&task)));
    let competition = app.config.competition();
    let mut card = Card::new(&competition.short_title);
    let title = match task.and_then(|task| competition.task(task)) {
        Some(info) => format!("{}, {}", info.title, board.stage_name),
        None => board.stage_name.to_string(),
    };
    let style = text_style(Weight::Semibold, 54.0, "ink");
    card.text(&title, &style, [LEFT, 182.0], RIGHT - LEFT);
    let note = match (visibility.hides_scores(board.stage), board.rows.is_empty()) {
        (true, _) => Some("The results are hidden until the organisers reveal them."),
        (false, true) => Some("No team has a result yet."),
        (false, false) => None,
    };
    match note {
        Some(note) => card.note(note, 280.0),
        None => draw_rows(&mut card, &board),
    }
    Ok(card)
}

fn draw_rows(card: &mut Card, board: &BoardView) {
    let rank = text_style(Weight::Semibold, 40.0, "soft");
    let name = text_style(Weight::Semibold, 40.0, "ink");
    let interval = text_style(Weight::Regular, 32.0, "soft");
    let mut y = FIRST_ROW;
    for row in board.rows.iter().take(MAX_TEAMS) {
        let result = board.task.and_then(|task| row.tasks.get(&task));
        let value = match result {
            Some(result) => PercentWithInterval::of_task(result),
            None => PercentWithInterval::of_score(row.score, &row.tasks, &board.weights),
        };
        card.text(&shared_rank(&board.rows, row), &rank, [LEFT, y], 80.0);
        let team = name.truncated(legible(row.team.as_str()), NAME_WIDTH);
        card.text(&team, &name, [NAMES_LEFT, y], NAME_WIDTH);
        // Tiers precede scores in the ranking.
        if let Some(tier) = row.tier {
            let x = NAMES_LEFT + name.width_px(&team) + 24.0;
            card.text(tier.title(), &tier_style(tier, 28.0), [x, y], 260.0);
        }
        let percent = format!("{} %", value.percent());
        card.text_at_end(&percent, &name, [RIGHT - 240.0, y], 220.0);
        card.text_at_end(&value.interval(), &interval, [RIGHT, y], 220.0);
        card.bar(&value, [NAMES_LEFT, y + 26.0], (RIGHT - NAMES_LEFT, 12.0));
        y += ROW_HEIGHT;
    }
}

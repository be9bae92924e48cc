//! `/season`: for sceptics. The commitment, the secret once it is public, and how every draw follows
//! from it.

use super::frame::{Frame, PageProblem, render};
use crate::{app::App, views::season::SeasonView};
use askama::Template;
use axum::{extract::State, response::Response};
use jiff::Timestamp;

#[derive(Template)]
#[template(path = "season.html")]
struct Page {
    frame: Frame,
    season: SeasonView,
    opened: String,
    closed: Option<String>,
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let season = SeasonView::now(&app).await?;
    let instant = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M:%S UTC").to_string();
    render(&Page {
        frame: Frame::of(&app, season.name.clone(), "/season"),
        opened: instant(season.created_at),
        closed: season.closed_at.map(instant),
        season,
    })
}

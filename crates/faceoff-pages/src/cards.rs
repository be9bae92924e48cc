//! Cards: the pictures of link previews, as chats show them, at `card.png` below the path of a page. They are public: for every caller a
//! picture shows what a visitor without an account sees on the page. Only visitors who hide results get a game's picture without them.

mod board;
mod episode;
mod evaluation;
mod game;
mod layout;
mod response;
mod still;
mod style;
mod team;

use axum::{Router, routing::get};
use faceoff_service::app::App;

pub(super) fn router() -> Router<App> {
    Router::new()
        .route("/card.png", get(board::overall))
        .route("/tasks/{task}/card.png", get(board::by_task))
        .route("/teams/{id}/card.png", get(team::picture))
        .route("/evaluations/{id}/card.png", get(evaluation::picture))
        .route(
            "/evaluations/{id}/episodes/{task}/{episode}/card.png",
            get(episode::picture),
        )
        .route("/games/{id}/card.png", get(game::picture))
}

//! The pages: server-rendered, complete without JavaScript. One file per page; the templates are in
//! `web/templates`, the styles in `web/static`, all compiled into the binary. What they show is in
//! [`views`](crate::views).

mod ablation;
mod assets;
mod board;
mod comparison;
mod evaluation;
mod figures;
mod frame;
mod problems;
mod season;
mod standing;
mod unknown;

pub(crate) use unknown::{unknown_method, unknown_path};

use crate::{app::App, layers};
use axum::{Router, middleware, routing::get};
use std::time::Duration;

/// All pages and their assets.
pub(crate) fn router(patience: Duration) -> Router<App> {
    Router::new()
        .route("/", get(board::overall))
        .route("/tasks/{task}", get(board::by_task))
        .route("/evaluations/{id}", get(evaluation::page))
        .route("/evaluations/{id}/compare/{other}", get(comparison::page))
        .route("/season", get(season::page))
        .route("/submissions/{id}/ablation", get(ablation::page))
        .route("/problems", get(problems::page))
        .route(assets::STYLE_PATH, get(assets::style))
        .route(assets::ICON_PATH, get(assets::icon))
        .layer(middleware::from_fn_with_state(patience, layers::time_out))
}

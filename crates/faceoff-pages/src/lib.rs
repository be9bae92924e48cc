//! The pages: server-rendered, complete without JavaScript. One file per page; templates are in `web/templates`, styles in
//! `web/static`, all compiled into the binary. Views are defined in [`faceoff_api::views`] and built in
//! [`faceoff_service::views`].
//!
//! Modules that are no page: `cards` draws the pictures of link previews, as chats show them; `frame` is what all pages have around
//! their content; `kept_form` keeps what was typed when a session expires; `page_auth` redirects visitors to the sign-in page;
//! `spoilers` hides results of games on request. `…_text`, `…_row` and `format` make texts and rows for several pages.

mod ablation;
mod account;
mod announcements;
mod assets;
mod baselines;
mod board;
mod board_status;
mod cards;
mod chart;
mod comparison;
mod compressed_text;
mod countdown;
mod csv_downloads;
mod dashboard;
mod dashboard_frame;
mod docs;
mod downloads;
mod embeddable;
mod episode_text;
mod episodes;
mod evaluation;
mod expired_session;
mod feed;
mod form_file;
mod format;
mod frame;
mod game;
mod game_row;
mod head_to_head;
mod help;
mod highlight;
mod join;
mod kept_form;
mod not_found;
mod organiser;
mod page_auth;
mod problems;
mod query;
mod register;
mod replay;
mod replay_section;
mod robots;
mod season;
mod side_by_side;
mod sign_in;
mod signed_in;
mod spoilers;
mod submission_row;
mod table_drawing;
mod team;
mod tournament;
mod tournament_text;
mod tournaments;
mod violation_map;

pub use embeddable::{Embeddable, StyledPicture};
pub use not_found::{method_not_allowed, path_not_found, problem_response};
pub use signed_in::identify_viewer;
pub use spoilers::SPOILERS_PATH;

use axum::{
    Router,
    extract::DefaultBodyLimit,
    middleware,
    routing::{get, post},
};
use faceoff_service::{api_document::ApiDocument, app::App, extract::MAX_JSON_BYTES, timeouts};
use std::{sync::Arc, time::Duration};

/// All pages and their assets. `time_limit` is the longest time of a request, uploads excepted; `api` is the API's
/// OpenAPI document, which the documentation shows.
pub fn router(app: &App, time_limit: Duration, api: ApiDocument) -> Router<App> {
    Router::new()
        .route("/", get(board::overall))
        .route("/embed", get(board::embedded::page))
        .route("/tasks/{task}", get(board::by_task))
        .route("/teams/{id}", get(team::page))
        .route("/evaluations/{id}", get(evaluation::page))
        .route("/evaluations/{id}/compare/{other}", get(comparison::page))
        .route(
            "/evaluations/{id}/compare/{other}/{task}/{episode}",
            get(comparison::pair::page),
        )
        .route("/evaluations/{id}/episodes", get(episodes::page))
        .route(
            "/evaluations/{id}/episodes.csv",
            get(csv_downloads::episodes),
        )
        .route(
            "/evaluations/{id}/answer-times.csv",
            get(csv_downloads::answer_times),
        )
        .route(
            "/submissions/{id}/ablation.csv",
            get(csv_downloads::ablation),
        )
        .route(
            "/evaluations/{id}/episodes/{task}/{episode}",
            get(replay::page),
        )
        .route(
            "/evaluations/{id}/episodes/{task}/{episode}/embed",
            get(replay::embedded),
        )
        .route(
            "/evaluations/{id}/episodes/{task}/{episode}/still.svg",
            get(episodes::still::picture),
        )
        .route("/games/{id}", get(game::page))
        .route("/games/{id}/embed", get(game::embedded))
        .route("/tournaments", get(tournaments::page))
        .route("/tournaments/{id}", get(tournament::page))
        .route("/tournaments/{id}/teams/{a}/{b}", get(head_to_head::page))
        .route(SPOILERS_PATH, post(spoilers::choose))
        .route("/season", get(season::page))
        .route("/submissions/{id}/ablation", get(ablation::page))
        .route(
            "/submissions/{id}/ablation/{profile}/{task}/{episode}",
            get(ablation::pair::page),
        )
        .route("/help", get(help::page))
        .route("/downloads", get(downloads::page))
        .route("/downloads/{name}", get(downloads::file))
        .route("/problems", get(problems::page))
        .route("/announcements", get(announcements::page))
        .route("/sign-in", get(sign_in::page).post(sign_in::submit))
        .route("/sign-out", post(sign_in::sign_out))
        .route("/account", get(account::page))
        .route("/join/{code}", get(join::page).post(join::submit))
        .route("/register", get(register::page).post(register::submit))
        .merge(cards::router())
        .merge(dashboard::router())
        .merge(organiser::router())
        .route(feed::FEED_PATH, get(feed::feed))
        .route("/robots.txt", get(robots::robots))
        .merge(docs::router(api))
        .merge(assets::router())
        .layer(middleware::from_fn_with_state(
            time_limit,
            timeouts::time_out,
        ))
        // Around the time limit: the form of a request that timed out is kept, too.
        .layer(middleware::from_fn_with_state(
            (Arc::clone(app), time_limit),
            expired_session::keep_form,
        ))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES))
        // Uploads have no fixed timeout: the receiver checks their least data rate.
        .merge(dashboard::uploads())
}

//! `/organiser`: the organiser dashboard, the pages with which organisers run a season.

mod checklist;
mod day;
mod decision;
mod decision_page;
mod form_lines;
mod log;
mod messages;
mod overview;
mod stage;
mod stage_form;
mod stages;
mod storage;
mod teams;
mod tournament;
mod tournament_form;
mod tournaments;
mod workers;

use super::dashboard::{access, settings};
use axum::{
    Router,
    routing::{get, post},
};
use faceoff_service::app::App;

/// All pages of the dashboard, and its old log address.
pub(super) fn router() -> Router<App> {
    Router::new()
        .route("/organiser", get(overview::page))
        .route("/organiser/day", get(day::page))
        .route("/organiser/teams", get(teams::page))
        .route("/organiser/teams/season", post(teams::change_season))
        .route("/organiser/teams/{id}", post(teams::change))
        .route("/organiser/stages", get(stages::page).post(stages::create))
        .route(
            "/organiser/stages/{id}",
            get(stage::page).post(stage::change),
        )
        .route(
            tournaments::PATH,
            get(tournaments::page).post(tournaments::open),
        )
        .route("/organiser/tournaments/{id}", get(tournament::page))
        .route("/organiser/tournaments/{id}/teams", post(tournament::enter))
        .route(
            "/organiser/messages",
            get(messages::page).post(messages::announce),
        )
        .route("/organiser/messages/terms", post(messages::publish_terms))
        .route("/organiser/messages/{id}", post(messages::answer))
        .route("/organiser/storage", get(storage::page))
        .route("/organiser/workers", get(workers::page))
        .route("/organiser/log", get(log::page))
        .route("/log", get(log::redirect_old_path))
        .route(
            "/organiser/decide/{*decision}",
            get(decision_page::page).post(decision_page::submit),
        )
        .merge(access::router("/organiser"))
        .merge(settings::router("/organiser"))
}

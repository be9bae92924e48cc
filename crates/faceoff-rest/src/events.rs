//! The event log of all changes, for organisers.

use axum::{Json, extract::State};
use faceoff_api::{requests::EventsQuery, views::event::EventsView};
use faceoff_service::{
    app::App, auth::Organiser, extract::QueryParams, problem::Problem, views::event,
};

/// Lists the events of the log, newest first: all changes, with time and actor.
#[utoipa::path(
    get, path = "/events", tag = "organiser", security(("organiser" = [])),
    params(EventsQuery), responses((status = 200, body = EventsView), (status = 422))
)]
pub(crate) async fn list_events(
    _: Organiser,
    State(app): State<App>,
    QueryParams(query): QueryParams<EventsQuery>,
) -> Result<Json<EventsView>, Problem> {
    event::page(&app, query).await.map(Json)
}

//! The log of all changes, for the organiser.

use crate::{
    app::App, auth::Organiser, extract::QueryParams, problem::Problem, requests::EventsQuery,
    views::event::EventsView,
};
use axum::{Json, extract::State};

/// What was changed, when and by whom, the newest first.
#[utoipa::path(
    get, path = "/events", tag = "organiser", security(("organiser" = [])),
    params(EventsQuery), responses((status = 200, body = EventsView), (status = 422))
)]
pub(crate) async fn list_events(
    _: Organiser,
    State(app): State<App>,
    QueryParams(query): QueryParams<EventsQuery>,
) -> Result<Json<EventsView>, Problem> {
    EventsView::page(&app, query).await.map(Json)
}

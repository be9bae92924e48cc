//! Who works for the server on other machines.

use crate::{app::App, auth::Organiser, views::workers::WorkersView};
use axum::{Json, extract::State};

/// Who plays beside the server's own slots, what they do, and what keeps others from it.
#[utoipa::path(
    get, path = "/workers", tag = "organiser", security(("organiser" = [])),
    responses((status = 200, body = WorkersView))
)]
pub(crate) async fn workers(_: Organiser, State(app): State<App>) -> Json<WorkersView> {
    Json(WorkersView::now(&app))
}

//! Is the server up?

use crate::{app::App, problem::Problem};
use axum::{Json, extract::State};
use serde::Serialize;
use utoipa::ToSchema;

/// The server is up and its database answers.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HealthView {
    /// Always `ok`; anything else is a problem with status 500.
    #[schema(example = "ok")]
    status: &'static str,
    /// Version of the server.
    version: &'static str,
}

/// Answers once the database does.
#[utoipa::path(get, path = "/health", tag = "public", responses((status = 200, body = HealthView)))]
pub(crate) async fn health(State(app): State<App>) -> Result<Json<HealthView>, Problem> {
    app.store.season().await?;
    Ok(Json(HealthView {
        status: "ok",
        version: env!("CARGO_PKG_VERSION"),
    }))
}

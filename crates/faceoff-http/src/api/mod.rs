//! The REST API. One file per resource: its routes, views and handlers carry the same name.
//!
//! The views are public: the command line's client reads the very types that the server writes.

pub mod ablations;
pub mod board;
pub mod comparisons;
pub mod days;
pub mod evaluations;
mod health;
pub mod me;
mod schema;
pub mod season;
pub mod submissions;
pub mod teams;
mod upload;

use crate::{App, extract::MAX_JSON_BYTES, layers};
use axum::{Json, Router, extract::DefaultBodyLimit, middleware, routing::get};
use std::{sync::Arc, time::Duration};
use utoipa::{
    Modify, OpenApi,
    openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme},
};
use utoipa_axum::{router::OpenApiRouter, routes};

/// Where the API lives.
pub const BASE: &str = "/api/v1";

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Faceoff",
        description = "Competition server for robot learning: teams upload agents, the server evaluates them daily.",
        license(name = "MIT OR Apache-2.0")
    ),
    modifiers(&Tokens),
    tags(
        (name = "public", description = "For everybody, without a token"),
        (name = "team", description = "With a team's token"),
        (name = "organiser", description = "With the organiser's token"),
    )
)]
struct Document;

struct Tokens;

impl Modify for Tokens {
    fn modify(&self, openapi: &mut utoipa::openapi::OpenApi) {
        let components = openapi.components.get_or_insert_default();
        for (name, description) in [
            ("team", "A team's token, fo_team_…, from POST /api/v1/teams"),
            (
                "organiser",
                "The organiser's token, fo_admin_…, made at the server's first start",
            ),
        ] {
            components.add_security_scheme(
                name,
                SecurityScheme::Http(
                    HttpBuilder::new()
                        .scheme(HttpAuthScheme::Bearer)
                        .description(Some(description))
                        .build(),
                ),
            );
        }
    }
}

/// All routes. `patience` bounds the time of every answer but an upload's.
pub(crate) fn router(patience: Duration) -> Router<App> {
    let resources = OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(health::health))
        .routes(routes!(season::season))
        .routes(routes!(season::close_season))
        .routes(routes!(board::board))
        .routes(routes!(board::task_board))
        .routes(routes!(me::me))
        .routes(routes!(teams::create_team, teams::list_teams))
        .routes(routes!(teams::replace_token))
        .routes(routes!(days::start_day))
        .routes(routes!(submissions::list_submissions))
        .routes(routes!(submissions::submission))
        .routes(routes!(submissions::evaluate_submission))
        .routes(routes!(ablations::ablation, ablations::order_ablation))
        .routes(routes!(evaluations::list_evaluations))
        .routes(routes!(evaluations::evaluation))
        .routes(routes!(evaluations::cancel_evaluation))
        .routes(routes!(evaluations::dataset))
        .routes(routes!(comparisons::compare))
        .layer(middleware::from_fn_with_state(patience, layers::time_out))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES));
    // An upload may take long as long as it moves; `upload` itself watches size and pauses.
    let uploads = OpenApiRouter::new()
        .routes(routes!(submissions::create_submission))
        .layer(DefaultBodyLimit::disable());
    let (router, document) = OpenApiRouter::new()
        .nest(BASE, resources.merge(uploads))
        .split_for_parts();
    let mut document = document;
    document.info = Document::openapi().info;
    let document = Arc::new(document);
    router.route(
        &format!("{BASE}/openapi.json"),
        get(move || {
            let document = Arc::clone(&document);
            async move { Json((*document).clone()) }
        }),
    )
}

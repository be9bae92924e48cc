//! The REST API: routes, parsing and their description. One file per resource; what it shows of one is in
//! [`views`](crate::views).

mod ablations;
mod board;
mod bundle_stream;
mod comparisons;
mod datasets;
mod days;
mod document;
mod episodes;
mod evaluations;
mod events;
mod health;
mod me;
mod rulings;
mod season;
mod sign_off;
mod stages;
mod submissions;
mod teams;
mod upload;

use crate::{app::App, extract::MAX_JSON_BYTES, layers, paths::API_BASE};
use axum::{Json, Router, extract::DefaultBodyLimit, middleware, routing::get};
use document::{Document, describe_errors};
use std::{sync::Arc, time::Duration};
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

/// All routes. `patience` bounds the time of every answer but an upload's.
pub(crate) fn router(patience: Duration) -> Router<App> {
    let resources = OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(health::health))
        .routes(routes!(health::live))
        .routes(routes!(season::season))
        .routes(routes!(season::close_season))
        .routes(routes!(board::board))
        .routes(routes!(board::task_board))
        .routes(routes!(me::me))
        .routes(routes!(teams::create_team, teams::list_teams))
        .routes(routes!(teams::replace_token))
        .routes(routes!(stages::list_stages, stages::create_stage))
        .routes(routes!(stages::stage, stages::change_stage))
        .routes(routes!(sign_off::start_final_day))
        .routes(routes!(sign_off::finalise_stage))
        .routes(routes!(days::start_day))
        .routes(routes!(events::list_events))
        .routes(routes!(submissions::list_submissions))
        .routes(routes!(
            submissions::submission,
            submissions::label_submission
        ))
        .routes(routes!(submissions::withdraw_submission))
        .routes(routes!(submissions::activate_submission))
        .routes(routes!(submissions::evaluate_submission))
        .routes(routes!(ablations::ablation, ablations::order_ablation))
        .routes(routes!(evaluations::list_evaluations))
        .routes(routes!(evaluations::evaluation))
        .routes(routes!(evaluations::cancel_evaluation))
        .routes(routes!(evaluations::rerun_evaluation))
        .routes(routes!(rulings::void_evaluation))
        .routes(routes!(rulings::void_day))
        .routes(routes!(rulings::disqualify_team))
        .routes(routes!(rulings::pause_queue))
        .routes(routes!(rulings::resume_queue))
        .routes(routes!(rulings::reinstate_team))
        .routes(routes!(datasets::dataset))
        .routes(routes!(datasets::violations))
        .routes(routes!(datasets::publish_evaluation))
        .routes(routes!(comparisons::compare))
        .layer(middleware::from_fn_with_state(patience, layers::time_out))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES));
    // An upload may take long as long as it moves; `upload` itself watches size and pauses.
    let uploads = OpenApiRouter::new()
        .routes(routes!(upload::create_submission))
        .layer(DefaultBodyLimit::disable());
    let (router, mut document) = OpenApiRouter::new()
        .nest(API_BASE, resources.merge(uploads))
        .split_for_parts();
    document.info = Document::openapi().info;
    describe_errors(&mut document);
    let document = Arc::new(document);
    router.route(
        &format!("{API_BASE}/openapi.json"),
        get(move || {
            let document = Arc::clone(&document);
            async move { Json((*document).clone()) }
        }),
    )
}

//! The season as one file, to take along.

use super::document::Binary;
use crate::archive::{self, one_at_a_time};
use axum::{
    body::Body,
    extract::State,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_api::requests::ArchiveQuery;
use faceoff_archive::Edition;
use faceoff_service::{app::App, auth::Organiser, extract::QueryParams, problem::Problem};
use std::sync::Arc;

/// The season as it is now: a `.tar.zst` with results, events, datasets and a database that `faceoff import` shows on
/// another server. For everybody (`edition=public`) it holds what a visitor gets; for the organiser also submissions, all
/// datasets and the whole log.
///
/// One is made at a time. What is under way is not in it.
#[utoipa::path(
    get, path = "/season/archive", tag = "organiser", security(("organiser" = [])), params(ArchiveQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zstd"),
        (status = 409, description = "this server shows a public archive, and the organiser's was asked for"),
        (status = 503, description = "another one is being made"),
        (status = 507, description = "the server's disk has too little room"),
    )
)]
pub(crate) async fn season_archive(
    organiser: Organiser,
    State(app): State<App>,
    QueryParams(query): QueryParams<ArchiveQuery>,
) -> Result<Response, Problem> {
    let edition = query.edition.unwrap_or(Edition::Organiser);
    let Ok(permit) = Arc::clone(&app.archiving).try_acquire_owned() else {
        return Err(one_at_a_time());
    };
    let prepared = archive::prepare(&app, edition).await?;
    tracing::info!(
        actor = %organiser.actor(),
        %edition,
        files = prepared.manifest.files.len(),
        bytes = prepared.manifest.total_bytes(),
        "an archive of the season is sent"
    );
    let disposition = format!("attachment; filename=\"{}\"", prepared.file_name());
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static("application/zstd"),
        ),
        (
            header::CONTENT_DISPOSITION,
            HeaderValue::try_from(disposition).map_err(Problem::internal)?,
        ),
    ];
    let body: Body = archive::send(prepared, permit);
    Ok((headers, body).into_response())
}

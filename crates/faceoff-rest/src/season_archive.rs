//! Download of the season archive, a file with the data of the whole season.

use super::document::Binary;
use crate::archive::{self, archive_busy};
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

/// Downloads the season as a `.tar.zst` file: results, events, datasets, and a database that `faceoff import` shows on
/// another server.
///
/// The public edition (`edition=public`) contains what visitors can see. The organiser's edition also contains
/// submissions, all datasets and the complete event log. Unfinished evaluations are not included. Only one archive is
/// made at a time.
#[utoipa::path(
    get, path = "/season/archive", tag = "organiser", security(("organiser" = [])), params(ArchiveQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zstd"),
        (status = 409, description = "this server shows a public archive, which has no organiser's edition"),
        (status = 503, description = "another archive is being made"),
        (status = 507, description = "the server's disk has too little free space"),
    )
)]
pub(crate) async fn season_archive(
    organiser: Organiser,
    State(app): State<App>,
    QueryParams(query): QueryParams<ArchiveQuery>,
) -> Result<Response, Problem> {
    let edition = query.edition.unwrap_or(Edition::Organiser);
    let Ok(permit) = Arc::clone(&app.archive_permit).try_acquire_owned() else {
        return Err(archive_busy());
    };
    let prepared = archive::collect(&app, edition).await?;
    tracing::info!(
        actor = %organiser.actor(),
        %edition,
        files = prepared.manifest.files.len(),
        bytes = prepared.manifest.total_bytes(),
        "sending a season archive"
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

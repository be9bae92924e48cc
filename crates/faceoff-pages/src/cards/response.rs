//! Responses with the picture of a card.

use super::layout::Card;
use crate::{embeddable::Embeddable, frame::PageProblem};
use axum::{
    Extension,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_picture::{Drawing, Picture, PictureError};
use faceoff_service::{
    app::App,
    problem::{Problem, ProblemKind},
    request_preconditions::{ETag, RequestPreconditions},
};
use std::sync::Arc;

/// Programs that show link previews fetch a picture once and store it; a short time is enough for many readers of one message.
const CACHE_CONTROL: &str = "public, max-age=60";

/// The picture of a card; `load` reads what it shows. The reads see one state of the season, but while the picture is drawn they
/// hold no connection to the database.
pub(super) async fn respond(
    app: &App,
    preconditions: &RequestPreconditions,
    load: impl Future<Output = Result<Card, PageProblem>>,
) -> Result<Response, PageProblem> {
    let card = app.store.read_consistently(load).await?;
    let drawing = card.into_drawing();
    let svg = drawing.svg();
    let tag = ETag::new("card", &[&svg]);
    let headers = [
        (header::ETAG, tag.header()),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static(CACHE_CONTROL),
        ),
    ];
    // Chats load the picture from their own pages.
    let headers = (Extension(Embeddable), headers);
    if let Some(not_modified) = preconditions.not_modified(&tag) {
        return Ok((headers, not_modified).into_response());
    }
    let key = blake3::hash(svg.as_bytes()).to_hex().to_string();
    let png = app.card_pictures.get(key, draw(app, drawing)).await?;
    let media_type = [(header::CONTENT_TYPE, HeaderValue::from_static("image/png"))];
    Ok((headers, media_type, Vec::clone(&png)).into_response())
}

/// Draws a picture on a blocking thread; one picture is drawn at a time, and few requests may wait for it. The thread holds both
/// permits to the end, also if the client has closed the connection.
async fn draw(app: &App, drawing: Drawing) -> Result<Arc<Vec<u8>>, Problem> {
    let request_permit = Arc::clone(&app.card_request_permits).try_acquire_owned();
    let request_permit = request_permit.map_err(|_| {
        let detail = "too many pictures are being drawn at the moment; try again in 2 s";
        Problem::new(ProblemKind::Busy, detail)
    })?;
    let drawing_permit = Arc::clone(&app.card_drawing_permit).acquire_owned().await;
    let drawing_permit = drawing_permit.map_err(Problem::internal)?;
    let draw = move || -> Result<Vec<u8>, PictureError> {
        let _permits = (request_permit, drawing_permit);
        Picture::draw(&drawing)?.png()
    };
    let png = tokio::task::spawn_blocking(draw)
        .await
        .map_err(Problem::internal)?;
    png.map(Arc::new).map_err(Problem::internal)
}

use crate::app::App;
use axum::{
    body::Body,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_store::StoreError;

/// An artifact as a file to be stored under `name`, which holds nothing that a header could trip over.
///
/// # Errors
/// [`StoreError::NotFound`] if there is none of this key.
pub(super) async fn download(
    app: &App,
    key: &str,
    media_type: &'static str,
    name: &str,
) -> Result<Response, StoreError> {
    let (bytes, stream) = app.store.artifacts().read(key).await?;
    let disposition = HeaderValue::try_from(format!("attachment; filename=\"{name}\""))
        .map_err(|error| StoreError::Artifacts(format!("{name:?}: {error}")))?;
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static(media_type)),
        (header::CONTENT_LENGTH, HeaderValue::from(bytes)),
        (header::CONTENT_DISPOSITION, disposition),
    ];
    Ok((headers, Body::from_stream(stream)).into_response())
}

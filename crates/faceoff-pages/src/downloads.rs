//! `/downloads`: files with which visitors develop agents on their own machines.

use super::{
    dashboard_frame,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{
    body::Body,
    extract::State,
    http::{HeaderMap, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    app::App,
    download::{DownloadContent, ListedDownload},
    extract::PathParam,
    problem::Problem,
};
use tokio::io::AsyncReadExt as _;
use tokio_util::io::ReaderStream;

#[derive(Template)]
#[template(path = "downloads.html")]
struct Page<'a> {
    frame: Frame,
    downloads: &'a [ListedDownload],
    source_url: Option<&'a str>,
}

impl Page<'_> {
    fn size(&self, bytes: &u64) -> String {
        dashboard_frame::bytes(*bytes)
    }
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    render(&Page {
        frame: Frame::load(&app, "/downloads").await?,
        downloads: &app.config.downloads.list().await,
        source_url: app.config.source_url.as_deref(),
    })
}

/// `/downloads/{name}`: the file.
pub(super) async fn file(
    State(app): State<App>,
    name: Result<PathParam<String>, Problem>,
    headers: HeaderMap,
) -> Result<Response, PageProblem> {
    let PathParam(name) = name?;
    let listed = app.config.downloads.list().await;
    let found = listed.iter().find(|listed| listed.download.name == name);
    let found = found.ok_or_else(|| Problem::not_found("download"))?;
    let tag = format!("\"{}\"", found.blake3);
    if headers
        .get(header::IF_NONE_MATCH)
        .is_some_and(|known| known.as_bytes() == tag.as_bytes())
    {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response());
    }
    let body = match &found.download.content {
        DownloadContent::Memory(bytes) => Body::from(bytes.clone()),
        DownloadContent::File(path) => {
            let file = tokio::fs::File::open(path)
                .await
                .map_err(Problem::internal)?;
            // A file that has grown since would not match its size and hash.
            Body::from_stream(ReaderStream::new(file.take(found.bytes)))
        }
    };
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_LENGTH, found.bytes.to_string()),
        (
            header::CONTENT_DISPOSITION,
            format!("attachment; filename=\"{}\"", found.download.name),
        ),
        (header::ETAG, tag),
    ];
    Ok((head, body).into_response())
}

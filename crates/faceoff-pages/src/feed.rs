//! `/feed.atom`: announcements and results of the season, for feed readers.

use askama::Template;
use axum::{
    extract::State,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{
        feed::{NewsItem, feed_id, newest},
        season::SeasonSummary,
    },
};
use jiff::{Timestamp, fmt::rfc2822};
use uuid::Uuid;

pub(super) const FEED_PATH: &str = "/feed.atom";
/// Proxies may cache the feed for a minute.
const CACHE_CONTROL: &str = "public, max-age=60";

#[derive(Template)]
#[template(path = "feed.xml")]
struct Feed {
    id: Uuid,
    season: String,
    updated: Timestamp,
    /// Public address of the server; empty if not configured, so that links are relative to the feed.
    base: String,
    entries: Vec<NewsItem>,
}

pub(super) async fn feed(State(app): State<App>, headers: HeaderMap) -> Result<Response, Problem> {
    let season = app.store.season().await?;
    let head = SeasonSummary::load(&app).await?;
    let entries = newest(&app).await?;
    let updated = entries
        .first()
        .map_or(season.created_at, |item| item.occurred_at);
    let feed = Feed {
        id: feed_id(&head.commitment),
        season: head.name,
        updated,
        base: app.config.public_url.clone().unwrap_or_default(),
        entries,
    };
    let body = feed.render().map_err(Problem::internal)?;
    let hash = blake3::hash(body.as_bytes()).to_hex();
    let tag = format!("\"{}\"", &hash[..32]);
    let modified = rfc2822::DateTimePrinter::new()
        .timestamp_to_rfc9110_string(&updated)
        .map_err(Problem::internal)?;
    let value = |text: &str| HeaderValue::try_from(text).map_err(Problem::internal);
    let response_headers = [
        (header::ETAG, value(&tag)?),
        (header::LAST_MODIFIED, value(&modified)?),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static(CACHE_CONTROL),
        ),
    ];
    if is_not_modified(&headers, &tag, updated) {
        return Ok((StatusCode::NOT_MODIFIED, response_headers).into_response());
    }
    let media_type = [(header::CONTENT_TYPE, "application/atom+xml; charset=utf-8")];
    Ok((response_headers, media_type, body).into_response())
}

/// Does the client have this version? Compares the tag, or the time if the request has no tag (RFC 9110, 13.2.2).
fn is_not_modified(headers: &HeaderMap, tag: &str, updated: Timestamp) -> bool {
    if headers.contains_key(header::IF_NONE_MATCH) {
        let tags = headers.get_all(header::IF_NONE_MATCH).into_iter();
        let tags = tags.filter_map(|line| line.to_str().ok());
        return tags
            .flat_map(|line| line.split(','))
            .map(|tag| tag.trim().trim_start_matches("W/"))
            .any(|known| known == tag || known == "*");
    }
    let since = headers.get(header::IF_MODIFIED_SINCE);
    let since = since.and_then(|since| since.to_str().ok());
    let since = since.and_then(|since| rfc2822::parse(since).ok());
    // The header has whole seconds.
    since.is_some_and(|since| updated.as_second() <= since.timestamp().as_second())
}

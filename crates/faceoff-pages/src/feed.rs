//! `/feed.atom`: the season's news, for feed readers.

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
        season::SeasonHead,
    },
};
use jiff::{Timestamp, fmt::rfc2822};
use uuid::Uuid;

pub(super) const FEED_PATH: &str = "/feed.atom";
/// Readers ask again when they like; what is between them and us may keep it for so long.
const KEPT: &str = "public, max-age=60";

#[derive(Template)]
#[template(path = "feed.xml")]
struct Feed {
    id: Uuid,
    season: String,
    updated: Timestamp,
    /// The server's address, if it knows it: else links begin where the feed was found.
    base: String,
    news: Vec<NewsItem>,
}

pub(super) async fn feed(State(app): State<App>, asked: HeaderMap) -> Result<Response, Problem> {
    let season = app.store.season().await?;
    let head = SeasonHead::now(&app).await?;
    let news = newest(&app).await?;
    let updated = news.first().map_or(season.created_at, |item| item.at);
    let feed = Feed {
        id: feed_id(&head.commitment),
        season: head.name,
        updated,
        base: app.config.public_url.clone().unwrap_or_default(),
        news,
    };
    let body = feed.render().map_err(Problem::internal)?;
    let hash = blake3::hash(body.as_bytes()).to_hex();
    let tag = format!("\"{}\"", &hash[..32]);
    let modified = rfc2822::DateTimePrinter::new()
        .timestamp_to_rfc9110_string(&updated)
        .map_err(Problem::internal)?;
    let value = |text: &str| HeaderValue::try_from(text).map_err(Problem::internal);
    let headers = [
        (header::ETAG, value(&tag)?),
        (header::LAST_MODIFIED, value(&modified)?),
        (header::CACHE_CONTROL, HeaderValue::from_static(KEPT)),
    ];
    if is_known(&asked, &tag, updated) {
        return Ok((StatusCode::NOT_MODIFIED, headers).into_response());
    }
    let media_type = [(header::CONTENT_TYPE, "application/atom+xml; charset=utf-8")];
    Ok((headers, media_type, body).into_response())
}

/// Has who asks this very one? By its tag, or by its time if no tag came (RFC 9110, 13.2.2).
fn is_known(asked: &HeaderMap, tag: &str, updated: Timestamp) -> bool {
    if asked.contains_key(header::IF_NONE_MATCH) {
        let tags = asked.get_all(header::IF_NONE_MATCH).into_iter();
        let tags = tags.filter_map(|line| line.to_str().ok());
        return tags
            .flat_map(|line| line.split(','))
            .map(|one| one.trim().trim_start_matches("W/"))
            .any(|one| one == tag || one == "*");
    }
    let since = asked.get(header::IF_MODIFIED_SINCE);
    let since = since.and_then(|since| since.to_str().ok());
    let since = since.and_then(|since| rfc2822::parse(since).ok());
    // The header has whole seconds.
    since.is_some_and(|since| updated.as_second() <= since.timestamp().as_second())
}

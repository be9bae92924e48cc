//! Styles, script and icon, compiled in.

use axum::{
    http::{HeaderValue, header},
    response::IntoResponse,
};
use std::sync::LazyLock;

pub(super) const STYLE_PATH: &str = "/static/faceoff.css";
pub(super) const SCRIPT_PATH: &str = "/static/live.js";
pub(super) const ICON_PATH: &str = "/static/faceoff.svg";
pub(super) const EPISODES_STYLE_PATH: &str = "/static/episodes.css";
pub(super) const REPLAY_STYLE_PATH: &str = "/static/replay.css";
pub(super) const REPLAY_SCRIPT_PATH: &str = "/static/replay.js";
/// The board, as previews of links show it: one of the documentation's pictures.
pub(super) const PREVIEW_PATH: &str = "/docs/images/board.png";

pub(super) const DESK_STYLE_PATH: &str = "/static/desk.css";
pub(super) const DESK_SCRIPT_PATH: &str = "/static/desk.js";

const STYLE: &str = include_str!("../../../../web/static/faceoff.css");
const EPISODES_STYLE: &str = include_str!("../../../../web/static/episodes.css");
const REPLAY_STYLE: &str = include_str!("../../../../web/static/replay.css");
/// Made of `web/client` by `make web`.
const REPLAY_SCRIPT: &str = include_str!("../../../../web/client/dist/replay.js");
const SCRIPT: &str = include_str!("../../../../web/static/live.js");
const ICON: &str = include_str!("../../../../web/static/faceoff.svg");

const DESK_STYLE: &str = include_str!("../../../../web/static/desk.css");
const DESK_SCRIPT: &str = include_str!("../../../../web/static/desk.js");

/// A path with a part that changes with what is there.
fn hashed(path: &str, content: &str) -> String {
    let hash = blake3::hash(content.as_bytes()).to_hex();
    format!("{path}?{}", &hash[..12])
}

/// The styles that only the desks have.
pub(super) fn desk_style_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(DESK_STYLE_PATH, DESK_STYLE));
    &URL
}

/// The one script: the desks'.
pub(super) fn desk_script_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(DESK_SCRIPT_PATH, DESK_SCRIPT));
    &URL
}

pub(super) async fn desk_style() -> impl IntoResponse {
    asset("text/css; charset=utf-8", DESK_STYLE)
}

pub(super) async fn desk_script() -> impl IntoResponse {
    asset("text/javascript; charset=utf-8", DESK_SCRIPT)
}

/// Where the pages load the styles from. The hash changes with the content, so that a browser may
/// keep them for good and still never shows a new page with old styles.
pub(super) fn style_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(STYLE_PATH, STYLE));
    &URL
}

/// Where pages of episodes load their styles from.
pub(super) fn episodes_style_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(EPISODES_STYLE_PATH, EPISODES_STYLE));
    &URL
}

/// Where a replay's page loads its own styles from.
pub(super) fn replay_style_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(REPLAY_STYLE_PATH, REPLAY_STYLE));
    &URL
}

/// Where a replay's page loads its script from.
pub(super) fn replay_script_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(REPLAY_SCRIPT_PATH, REPLAY_SCRIPT));
    &URL
}

/// Where the pages load their script from.
pub(super) fn script_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| hashed(SCRIPT_PATH, SCRIPT));
    &URL
}

fn hashed(path: &str, content: &str) -> String {
    let hash = blake3::hash(content.as_bytes()).to_hex();
    format!("{path}?{}", &hash[..12])
}

fn asset(media_type: &'static str, content: &'static str) -> impl IntoResponse {
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static(media_type)),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static("public, max-age=31536000, immutable"),
        ),
    ];
    (headers, content)
}

pub(super) async fn style() -> impl IntoResponse {
    asset("text/css; charset=utf-8", STYLE)
}

pub(super) async fn script() -> impl IntoResponse {
    asset("text/javascript; charset=utf-8", SCRIPT)
}

pub(super) async fn icon() -> impl IntoResponse {
    asset("image/svg+xml", ICON)
}

pub(super) async fn episodes_style() -> impl IntoResponse {
    asset("text/css; charset=utf-8", EPISODES_STYLE)
}

pub(super) async fn replay_style() -> impl IntoResponse {
    asset("text/css; charset=utf-8", REPLAY_STYLE)
}

pub(super) async fn replay_script() -> impl IntoResponse {
    asset("text/javascript; charset=utf-8", REPLAY_SCRIPT)
}

//! Styles and icon, compiled in.

use axum::{
    http::{HeaderValue, header},
    response::IntoResponse,
};
use std::sync::LazyLock;

pub(super) const STYLE_PATH: &str = "/static/faceoff.css";
pub(super) const ICON_PATH: &str = "/static/faceoff.svg";
/// The board, as previews of links show it: one of the documentation's pictures.
pub(super) const PREVIEW_PATH: &str = "/docs/images/board.png";

const STYLE: &str = include_str!("../../../../web/static/faceoff.css");
const ICON: &str = include_str!("../../../../web/static/faceoff.svg");

/// Where the pages load the styles from. The hash changes with the content, so that a browser may
/// keep them for good and still never shows a new page with old styles.
pub(super) fn style_url() -> &'static str {
    static URL: LazyLock<String> = LazyLock::new(|| {
        let hash = blake3::hash(STYLE.as_bytes()).to_hex();
        format!("{STYLE_PATH}?{}", &hash[..12])
    });
    &URL
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

pub(super) async fn icon() -> impl IntoResponse {
    asset("image/svg+xml", ICON)
}

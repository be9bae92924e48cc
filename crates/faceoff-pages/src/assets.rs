//! Styles, scripts and icon, compiled in.

use crate::packed::{Packed, packed};
use axum::{
    Router,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
    routing::get,
};
use faceoff_service::app::App;
use std::sync::OnceLock;

/// A file that pages load.
#[derive(Debug)]
pub(super) struct Asset {
    path: &'static str,
    media_type: &'static str,
    content: Packed,
    url: OnceLock<String>,
}

const CSS: &str = "text/css; charset=utf-8";
const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

pub(super) static STYLE: Asset = Asset::new(
    "/static/faceoff.css",
    CSS,
    packed!("web/static/faceoff.css"),
);
/// Of all pages: what follows a day under way, and tells times by the reader's clock.
pub(super) static SCRIPT: Asset =
    Asset::new("/static/live.js", JAVASCRIPT, packed!("web/static/live.js"));
pub(super) static ICON: Asset = Asset::new(
    "/static/faceoff.svg",
    "image/svg+xml",
    packed!("web/static/faceoff.svg"),
);
pub(super) static DESK_STYLE: Asset =
    Asset::new("/static/desk.css", CSS, packed!("web/static/desk.css"));
pub(super) static DESK_SCRIPT: Asset =
    Asset::new("/static/desk.js", JAVASCRIPT, packed!("web/static/desk.js"));
pub(super) static EPISODES_STYLE: Asset = Asset::new(
    "/static/episodes.css",
    CSS,
    packed!("web/static/episodes.css"),
);
pub(super) static REPLAY_STYLE: Asset =
    Asset::new("/static/replay.css", CSS, packed!("web/static/replay.css"));
/// Made of `web/client` by `make web`.
pub(super) static REPLAY_SCRIPT: Asset = Asset::new(
    "/static/replay.js",
    JAVASCRIPT,
    packed!("web/client/dist/replay.js"),
);

static ALL: [&Asset; 8] = [
    &STYLE,
    &SCRIPT,
    &ICON,
    &DESK_STYLE,
    &DESK_SCRIPT,
    &EPISODES_STYLE,
    &REPLAY_STYLE,
    &REPLAY_SCRIPT,
];

/// The board, as previews of links show it: one of the documentation's pictures.
pub(super) const PREVIEW_PATH: &str = "/docs/images/board.png";

impl Asset {
    const fn new(path: &'static str, media_type: &'static str, content: Packed) -> Self {
        Self {
            path,
            media_type,
            content,
            url: OnceLock::new(),
        }
    }

    /// Where pages load it from. The hash changes with the content, so that a browser may keep it for good and still never
    /// shows a new page with old styles.
    pub(super) fn url(&self) -> &str {
        self.url.get_or_init(|| {
            let hash = blake3::hash(self.content.text().as_bytes()).to_hex();
            format!("{}?{}", self.path, &hash[..12])
        })
    }

    fn answer(&'static self) -> Response {
        let headers = [
            (
                header::CONTENT_TYPE,
                HeaderValue::from_static(self.media_type),
            ),
            (
                header::CACHE_CONTROL,
                HeaderValue::from_static("public, max-age=31536000, immutable"),
            ),
        ];
        (headers, self.content.text()).into_response()
    }
}

pub(super) fn router() -> Router<App> {
    ALL.into_iter().fold(Router::new(), |router, asset| {
        router.route(asset.path, get(move || async { asset.answer() }))
    })
}

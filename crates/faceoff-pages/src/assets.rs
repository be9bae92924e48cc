//! Styles, scripts and icon, compiled in.

use crate::compressed_text::{CompressedText, compressed_text};
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
    content: CompressedText,
    url: OnceLock<String>,
}

const CSS: &str = "text/css; charset=utf-8";
const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

pub(super) static STYLE: Asset = Asset::new(
    "/static/faceoff.css",
    CSS,
    compressed_text!("web/static/faceoff.css"),
);
/// Loaded by all pages: live updates, and times in the visitor's time zone.
pub(super) static SCRIPT: Asset = Asset::new(
    "/static/live.js",
    JAVASCRIPT,
    compressed_text!("web/static/live.js"),
);
pub(super) static ICON: Asset = Asset::new(
    "/static/faceoff.svg",
    "image/svg+xml",
    compressed_text!("web/static/faceoff.svg"),
);
pub(super) static DASHBOARD_STYLE: Asset = Asset::new(
    "/static/dashboard.css",
    CSS,
    compressed_text!("web/static/dashboard.css"),
);
pub(super) static DASHBOARD_SCRIPT: Asset = Asset::new(
    "/static/dashboard.js",
    JAVASCRIPT,
    compressed_text!("web/static/dashboard.js"),
);
pub(super) static DOCS_STYLE: Asset = Asset::new(
    "/static/docs.css",
    CSS,
    compressed_text!("web/static/docs.css"),
);
pub(super) static DOCS_SCRIPT: Asset = Asset::new(
    "/static/docs.js",
    JAVASCRIPT,
    compressed_text!("web/static/docs.js"),
);
pub(super) static EPISODES_STYLE: Asset = Asset::new(
    "/static/episodes.css",
    CSS,
    compressed_text!("web/static/episodes.css"),
);
pub(super) static EPISODE_LIST_STYLE: Asset = Asset::new(
    "/static/episode-list.css",
    CSS,
    compressed_text!("web/static/episode-list.css"),
);
pub(super) static REPLAY_STYLE: Asset = Asset::new(
    "/static/replay.css",
    CSS,
    compressed_text!("web/static/replay.css"),
);
/// The front page and the boards.
pub(super) static FRONT_STYLE: Asset = Asset::new(
    "/static/front.css",
    CSS,
    compressed_text!("web/static/front.css"),
);
pub(super) static TASK_BOARD_STYLE: Asset = Asset::new(
    "/static/task-board.css",
    CSS,
    compressed_text!("web/static/task-board.css"),
);
/// Built from `web/client` by `make web`.
pub(super) static REPLAY_SCRIPT: Asset = Asset::new(
    "/static/replay.js",
    JAVASCRIPT,
    compressed_text!("web/client/dist/replay.js"),
);

static ALL: [&Asset; 13] = [
    &STYLE,
    &SCRIPT,
    &ICON,
    &DASHBOARD_STYLE,
    &DASHBOARD_SCRIPT,
    &DOCS_STYLE,
    &DOCS_SCRIPT,
    &EPISODES_STYLE,
    &EPISODE_LIST_STYLE,
    &REPLAY_STYLE,
    &FRONT_STYLE,
    &TASK_BOARD_STYLE,
    &REPLAY_SCRIPT,
];

/// Picture of the board for link previews; it belongs to the documentation.
pub(super) const PREVIEW_PATH: &str = "/docs/images/board.png";

impl Asset {
    const fn new(path: &'static str, media_type: &'static str, content: CompressedText) -> Self {
        Self {
            path,
            media_type,
            content,
            url: OnceLock::new(),
        }
    }

    /// Address for pages. The hash changes with the content: browsers cache it without limit and still never show a new page
    /// with old styles.
    pub(super) fn url(&self) -> &str {
        self.url.get_or_init(|| {
            let hash = blake3::hash(self.content.text().as_bytes()).to_hex();
            format!("{}?{}", self.path, &hash[..12])
        })
    }

    pub(super) fn text(&self) -> &str {
        self.content.text()
    }

    fn response(&'static self) -> Response {
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
        router.route(asset.path, get(move || async { asset.response() }))
    })
}

//! The frame of every page (header, navigation and footer), and the rendering of pages and of problems.

use super::{assets, format, signed_in::SignedIn};
use askama::Template;
use axum::{
    http::{HeaderValue, header},
    response::{Html, IntoResponse, Response},
};
use faceoff_service::{
    app::AppState, problem::Problem, request_preconditions::ETag, views::season::SeasonSummary,
};
use faceoff_types::Ruleset;
use std::sync::atomic::Ordering;

/// The picture of link previews, the cards that chats show for a link.
#[derive(Debug)]
pub(super) struct CardPicture {
    pub(super) address: String,
    /// Text in place of the picture.
    pub(super) alt: String,
    /// Is it drawn for this page?
    pub(super) is_own: bool,
}

/// Header, navigation and footer of every page.
#[derive(Debug)]
pub(super) struct Frame {
    /// Name of the season; empty on pages that do not load it.
    pub(super) season: String,
    /// The ruleset of new evaluations; `None` on pages that are the same for all competitions.
    pub(super) ruleset: Option<Ruleset>,
    /// Notice about a problem of the server.
    pub(super) notice: Option<&'static str>,
    /// Notice that the season is archived; `None` for a running season.
    pub(super) archived_notice: Option<String>,
    /// Path of the current page, for the navigation.
    pub(super) current: String,
    pub(super) style: &'static str,
    pub(super) script: &'static str,
    pub(super) icon: &'static str,
    has_tournaments: bool,
    /// The signed-in user; `None` for visitors.
    pub(super) signed_in: Option<SignedIn>,
    /// What agents do in this competition; `None` on pages that are the same for all competitions.
    pub(super) subject: Option<String>,
    /// The picture of link previews; `None` if the public address of the server is not configured.
    pub(super) card: Option<CardPicture>,
    /// The page's own address, for link previews and search engines; `None` without a public address, and on pages that have several.
    pub(super) address: Option<String>,
}

/// In place of the path of a page to which no entry of the navigation leads, so that none is marked as current.
pub(super) const NO_ENTRY: &str = "";

impl Frame {
    /// The frame of a page that names the season. `current` is the path of the page, or [`NO_ENTRY`].
    pub(super) async fn load(app: &AppState, current: impl Into<String>) -> Result<Self, Problem> {
        let season = SeasonSummary::load(app).await?;
        Ok(Self::for_app(app, season.name, current))
    }

    /// The frame of a page of this server's season. `season` is its name; empty on pages that do not load it.
    pub(super) fn for_app(app: &AppState, season: String, current: impl Into<String>) -> Self {
        let is_disk_full = app.store.free_space().is_short();
        Self {
            notice: is_disk_full.then_some(
                "The disk of the server is almost full: the queue is paused and uploads are refused. Nothing is lost; \
                 evaluations resume automatically when there is enough space.",
            ),
            archived_notice: app.store.archived_season().map(|archived| {
                format!(
                    "Archived season as of {}. Nothing changes any more.",
                    archived.made_at.strftime("%Y-%m-%d at %H:%M UTC")
                )
            }),
            has_tournaments: app.has_tournaments.load(Ordering::Relaxed),
            ruleset: Some(app.config.competition().ruleset()),
            subject: Some(app.config.competition().subject.clone()),
            season,
            ..Self::without_season(current)
        }
        .with_preview(app)
    }

    /// Sets the picture for link previews of pages that have no own one.
    fn with_preview(self, app: &AppState) -> Self {
        let base = app.config.public_url.as_deref();
        Self {
            card: base.map(|base| CardPicture {
                address: format!("{base}{}", assets::PREVIEW_PATH),
                alt: "The board: teams with scores, tiers and intervals".to_owned(),
                is_own: false,
            }),
            ..self
        }
    }

    /// Sets the page's own picture for link previews. `path`: a route of `cards.rs`; `alt`: what the picture shows.
    pub(super) fn with_card(self, app: &AppState, path: &str, alt: String) -> Self {
        let base = app.config.public_url.as_deref();
        Self {
            card: base.map(|base| CardPicture {
                address: format!("{base}{path}"),
                alt,
                is_own: true,
            }),
            ..self
        }
    }

    /// Sets the page's own address.
    pub(super) fn with_address(self, app: &AppState, path: &str) -> Self {
        let base = app.config.public_url.as_deref();
        Self {
            address: base.map(|base| format!("{base}{path}")),
            ..self
        }
    }

    /// The frame of a page without anything from the store, such as a page of an error: the season's name is left out.
    pub(super) fn without_season(current: impl Into<String>) -> Self {
        Self {
            season: String::new(),
            notice: None,
            archived_notice: None,
            ruleset: None,
            current: current.into(),
            style: assets::STYLE.url(),
            script: assets::SCRIPT.url(),
            icon: assets::ICON.url(),
            has_tournaments: false,
            signed_in: SignedIn::current(),
            subject: None,
            card: None,
            address: None,
        }
    }

    /// The title in link previews of pages that have no own one: the subject with a capital letter.
    pub(super) fn card_title(&self) -> String {
        format::capitalised(self.subject.as_deref().unwrap_or("competition"))
    }

    /// Path and name of each navigation entry.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let tournaments = self
            .has_tournaments
            .then_some(("/tournaments", "Tournament"));
        [("/", "Board")].into_iter().chain(tournaments).chain([
            ("/season", "Season"),
            ("/announcements", "Announcements"),
            ("/docs", "Docs"),
        ])
    }

    /// Is the page at or below this navigation entry? The boards of the tasks are below the first entry.
    pub(super) fn is_at(&self, entry: &str) -> bool {
        let subpages = if entry == "/" { "/tasks" } else { entry };
        let rest = self.current.strip_prefix(subpages);
        self.current == entry || rest.is_some_and(|rest| rest.starts_with('/'))
    }
}

/// Renders a page with an ETag; a layer of the server answers 304 if the client has this version.
pub(super) fn render_with_etag(page: &impl Template) -> Result<Response, PageProblem> {
    let html = page
        .render()
        .map_err(|error| PageProblem(Problem::internal(error)))?;
    let tag = ETag::new("page", &[&html]);
    let headers = [
        (header::ETAG, tag.header()),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static("private, no-cache"),
        ),
        (
            header::VARY,
            HeaderValue::from_static("authorization, cookie"),
        ),
    ];
    Ok((headers, Html(html)).into_response())
}

pub(super) fn render(page: &impl Template) -> Result<Response, PageProblem> {
    match page.render() {
        Ok(html) => Ok(Html(html).into_response()),
        Err(error) => Err(PageProblem(Problem::internal(error))),
    }
}

/// Response extension: a fault of the server, which the page shows.
#[derive(Debug, Clone)]
pub(super) struct ServerFault {
    pub(super) title: &'static str,
    pub(super) detail: String,
}

impl ServerFault {
    pub(super) fn of(problem: &Problem) -> Self {
        Self {
            title: problem.kind().title(),
            detail: format::sentence(problem.detail()),
        }
    }
}

/// A problem, shown as a page.
pub(super) struct PageProblem(pub(super) Problem);

impl<E: Into<Problem>> From<E> for PageProblem {
    fn from(error: E) -> Self {
        Self(error.into())
    }
}

#[derive(Template)]
#[template(path = "problem.html")]
struct ProblemPage {
    frame: Frame,
    title: &'static str,
    detail: String,
    status: u16,
}

impl IntoResponse for PageProblem {
    fn into_response(self) -> Response {
        let kind = self.0.kind();
        let page = ProblemPage {
            frame: Frame::without_season(NO_ENTRY),
            title: kind.title(),
            detail: format::sentence(self.0.detail()),
            status: kind.status().as_u16(),
        };
        match page.render() {
            Ok(html) => {
                let mut response = (kind.status(), Html(html)).into_response();
                response
                    .headers_mut()
                    .extend(self.0.headers().iter().cloned());
                if kind.status().is_server_error() {
                    response.extensions_mut().insert(ServerFault::of(&self.0));
                }
                response
            }
            Err(error) => Problem::internal(error).into_response(),
        }
    }
}

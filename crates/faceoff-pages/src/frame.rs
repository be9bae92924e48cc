use super::assets;
use askama::Template;
use axum::{
    http::{HeaderValue, header},
    response::{Html, IntoResponse, Response},
};
use faceoff_service::{app::AppState, conditions::ETag, problem::Problem};
use faceoff_types::RULESET;
use std::sync::atomic::Ordering;

/// What surrounds the content of every page.
#[derive(Debug)]
pub(super) struct Frame {
    /// The season's name; empty where the page does not know it.
    pub(super) season: String,
    pub(super) ruleset: &'static str,
    /// Something is amiss that everybody who waits should know of.
    pub(super) notice: Option<&'static str>,
    /// The season is an archive's, in words; none of one that runs.
    pub(super) archived: Option<String>,
    /// Path of the navigation entry that this page is.
    pub(super) current: String,
    pub(super) style: &'static str,
    pub(super) script: &'static str,
    pub(super) icon: &'static str,
    /// Has the season a tournament?
    has_tournaments: bool,
    /// Address of the picture that a preview of a link to the page shows; none where the server does not know its own.
    pub(super) preview: Option<String>,
}

impl Frame {
    /// Of a page that shows what the store holds.
    pub(super) fn of(app: &AppState, season: String, current: impl Into<String>) -> Self {
        let short = app.store.room().is_short();
        Self {
            notice: short.then_some(
                "The server's disk has too little room: the queue pauses and uploads are refused. Nothing \
                 is lost; work goes on by itself when there is room again.",
            ),
            archived: app.store.archived().map(|archived| {
                format!(
                    "Archived season: you see it as it was on {}. Nothing changes any more.",
                    archived.made_at.strftime("%Y-%m-%d at %H:%M UTC")
                )
            }),
            has_tournaments: app.has_tournaments.load(Ordering::Relaxed),
            preview: app
                .config
                .public_url
                .as_deref()
                .map(|base| format!("{base}{}", assets::PREVIEW_PATH)),
            ..Self::new(season, current)
        }
    }

    /// Of a page about nothing that moves.
    pub(super) fn new(season: String, current: impl Into<String>) -> Self {
        Self {
            season,
            notice: None,
            archived: None,
            ruleset: RULESET,
            current: current.into(),
            style: assets::STYLE.url(),
            script: assets::SCRIPT.url(),
            icon: assets::ICON.url(),
            has_tournaments: false,
            preview: None,
        }
    }

    /// The entries of the navigation: paths and names.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let tournaments = self
            .has_tournaments
            .then_some(("/tournaments", "Tournament"));
        [("/", "Board")].into_iter().chain(tournaments).chain([
            ("/season", "Season"),
            ("/announcements", "News"),
            ("/docs", "Docs"),
            ("/account", "Account"),
        ])
    }

    /// Is the page below this entry of the navigation? The boards of the tasks are below the first one.
    pub(super) fn is_at(&self, entry: &str) -> bool {
        let below = if entry == "/" { "/tasks" } else { entry };
        let rest = self.current.strip_prefix(below);
        self.current == entry || rest.is_some_and(|rest| rest.starts_with('/'))
    }
}

/// Renders a page that has a tag, by which who has it already is told so (`layers.rs`).
pub(super) fn render_tagged(page: &impl Template) -> Result<Response, PageProblem> {
    let html = page
        .render()
        .map_err(|error| PageProblem(Problem::internal(error)))?;
    let tag = ETag::of("page", &[&html]);
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

/// A problem, shown as a page.
pub(super) struct PageProblem(pub(super) Problem);

impl From<Problem> for PageProblem {
    fn from(problem: Problem) -> Self {
        Self(problem)
    }
}

#[derive(Template)]
#[template(path = "problem.html")]
struct ProblemPage<'a> {
    frame: Frame,
    title: &'a str,
    detail: &'a str,
    status: u16,
}

impl IntoResponse for PageProblem {
    fn into_response(self) -> Response {
        let kind = self.0.kind();
        let page = ProblemPage {
            frame: Frame::new(String::new(), ""),
            title: kind.title(),
            detail: self.0.detail(),
            status: kind.status().as_u16(),
        };
        match page.render() {
            Ok(html) => {
                let mut response = (kind.status(), Html(html)).into_response();
                response
                    .headers_mut()
                    .extend(self.0.headers().iter().cloned());
                response
            }
            Err(error) => Problem::internal(error).into_response(),
        }
    }
}

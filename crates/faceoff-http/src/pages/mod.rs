//! The pages: server-rendered, complete without JavaScript. One file per page; the templates are in
//! `web/templates`, the styles in `web/static`, all compiled into the binary.

mod ablation;
mod assets;
mod board;
mod comparison;
mod evaluation;
mod figures;
mod problems;
mod season;

use crate::{
    App, api, layers,
    problem::{Problem, ProblemKind},
};
use askama::Template;
use axum::{
    Router,
    extract::Request,
    http::{HeaderMap, Method, Uri, header},
    middleware,
    response::{Html, IntoResponse, Response},
    routing::get,
};
use faceoff_store::StoreError;
use faceoff_types::RULESET;
use std::time::Duration;

/// All pages and their assets.
pub(crate) fn router(patience: Duration) -> Router<App> {
    Router::new()
        .route("/", get(board::overall))
        .route("/tasks/{task}", get(board::by_task))
        .route("/evaluations/{id}", get(evaluation::page))
        .route("/evaluations/{id}/compare/{other}", get(comparison::page))
        .route("/season", get(season::page))
        .route("/submissions/{id}/ablation", get(ablation::page))
        .route("/problems", get(problems::page))
        .route(assets::STYLE_PATH, get(assets::style))
        .route(assets::ICON_PATH, get(assets::icon))
        .layer(middleware::from_fn_with_state(patience, layers::time_out))
}

/// What surrounds the content of every page.
#[derive(Debug)]
struct Frame {
    /// The season's name; empty where the page does not know it.
    season: String,
    ruleset: &'static str,
    /// Path of the navigation entry that this page is.
    current: String,
    style: &'static str,
    icon: &'static str,
}

impl Frame {
    fn new(season: String, current: impl Into<String>) -> Self {
        Self {
            season,
            ruleset: RULESET,
            current: current.into(),
            style: assets::style_url(),
            icon: assets::ICON_PATH,
        }
    }
}

/// Renders a page.
fn render(page: &impl Template) -> Result<Response, PageProblem> {
    match page.render() {
        Ok(html) => Ok(Html(html).into_response()),
        Err(error) => Err(PageProblem(Problem::internal(error))),
    }
}

/// A problem, shown as a page.
struct PageProblem(Problem);

impl From<Problem> for PageProblem {
    fn from(problem: Problem) -> Self {
        Self(problem)
    }
}

impl From<StoreError> for PageProblem {
    fn from(error: StoreError) -> Self {
        Self(match error {
            // A visitor has no token, so the API's words about one would mislead.
            StoreError::NotFound(what) => {
                Problem::new(ProblemKind::NotFound, format!("there is no such {what}"))
            }
            error => error.into(),
        })
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

/// A page for people, problem details for programs.
fn for_whom(path: &str, headers: &HeaderMap, problem: Problem) -> Response {
    let wants_page = headers
        .get(header::ACCEPT)
        .and_then(|accept| accept.to_str().ok())
        .is_some_and(|accept| accept.contains("text/html"));
    if wants_page && !path.starts_with("/api") {
        PageProblem(problem).into_response()
    } else {
        problem.into_response()
    }
}

/// Nothing is at this path.
pub(crate) async fn unknown_path(uri: Uri, headers: HeaderMap) -> Response {
    let path = uri.path();
    let detail = format!(
        "there is nothing at {path}; the API is described at {}/openapi.json, the board is at /",
        api::BASE
    );
    for_whom(path, &headers, Problem::new(ProblemKind::NotFound, detail))
}

/// Something is at this path, but not for this method.
pub(crate) async fn unknown_method(method: Method, request: Request) -> Response {
    let path = request.uri().path();
    let detail = format!("{path} does not take {method}; the header Allow lists what it takes");
    for_whom(
        path,
        request.headers(),
        Problem::new(ProblemKind::MethodNotAllowed, detail),
    )
}

//! Responses for unknown paths and methods: a page for browsers, problem details for API clients.

use super::frame::PageProblem;
use axum::{
    extract::Request,
    http::{HeaderMap, Method, Uri},
    response::{IntoResponse, Response},
};
use faceoff_api::paths::API_BASE;
use faceoff_service::{
    content_negotiation::wants_page,
    problem::{Problem, ProblemKind},
};

/// A page if the client accepts HTML and the path is not below `/api`; else problem details.
pub fn problem_response(path: &str, headers: &HeaderMap, problem: Problem) -> Response {
    if wants_page(headers) && !path.starts_with("/api") {
        PageProblem::from(problem).into_response()
    } else {
        problem.into_response()
    }
}

pub async fn path_not_found(uri: Uri, headers: HeaderMap) -> Response {
    let path = uri.path();
    let detail = format!(
        "there is nothing at {path}; the API is described at {}/openapi.json, the board is at /",
        API_BASE
    );
    problem_response(path, &headers, Problem::new(ProblemKind::NotFound, detail))
}

pub async fn method_not_allowed(method: Method, request: Request) -> Response {
    let path = request.uri().path();
    let detail = format!("{path} does not take {method}; the header Allow lists what it takes");
    problem_response(
        path,
        request.headers(),
        Problem::new(ProblemKind::MethodNotAllowed, detail),
    )
}

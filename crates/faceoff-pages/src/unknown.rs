//! Where nothing is: a page for people, problem details for programs.

use super::frame::PageProblem;
use axum::{
    extract::Request,
    http::{HeaderMap, Method, Uri, header},
    response::{IntoResponse, Response},
};
use faceoff_api::paths::API_BASE;
use faceoff_service::problem::{Problem, ProblemKind};

/// A problem as whoever asked can read it.
pub fn for_whom(path: &str, headers: &HeaderMap, problem: Problem) -> Response {
    let wants_page = headers
        .get(header::ACCEPT)
        .and_then(|accept| accept.to_str().ok())
        .is_some_and(|accept| accept.contains("text/html"));
    if wants_page && !path.starts_with("/api") {
        PageProblem::from(problem).into_response()
    } else {
        problem.into_response()
    }
}

/// Nothing is at this path.
pub async fn unknown_path(uri: Uri, headers: HeaderMap) -> Response {
    let path = uri.path();
    let detail = format!(
        "there is nothing at {path}; the API is described at {}/openapi.json, the board is at /",
        API_BASE
    );
    for_whom(path, &headers, Problem::new(ProblemKind::NotFound, detail))
}

/// Something is at this path, but not for this method.
pub async fn unknown_method(method: Method, request: Request) -> Response {
    let path = request.uri().path();
    let detail = format!("{path} does not take {method}; the header Allow lists what it takes");
    for_whom(
        path,
        request.headers(),
        Problem::new(ProblemKind::MethodNotAllowed, detail),
    )
}

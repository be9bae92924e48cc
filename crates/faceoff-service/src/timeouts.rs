//! Time limit of request handlers.

use crate::{
    boxed_future,
    problem::{Problem, ProblemKind},
};
use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};
use std::time::Duration;

/// Responds with `Busy` if a handler takes longer than `timeout`.
#[boxed_future]
pub async fn time_out(State(timeout): State<Duration>, request: Request, next: Next) -> Response {
    match tokio::time::timeout(timeout, next.run(request)).await {
        Ok(response) => response,
        Err(_) => problem(timeout).into_response(),
    }
}

/// The problem of a request that took longer than `timeout`.
#[must_use]
pub fn problem(timeout: Duration) -> Problem {
    let seconds = timeout.as_secs_f64();
    let detail = format!("the response took longer than {seconds} s; try again later");
    Problem::new(ProblemKind::Busy, detail)
}

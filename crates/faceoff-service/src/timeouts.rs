//! Time limit of request handlers.

use crate::{
    boxed,
    problem::{Problem, ProblemKind},
};
use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};
use std::time::Duration;

/// Responds with `Busy` if a handler takes longer than `timeout`.
#[boxed]
pub async fn time_out(State(timeout): State<Duration>, request: Request, next: Next) -> Response {
    match tokio::time::timeout(timeout, next.run(request)).await {
        Ok(response) => response,
        Err(_) => Problem::new(
            ProblemKind::Busy,
            format!(
                "the response took longer than {} s; try again later",
                timeout.as_secs_f64()
            ),
        )
        .into_response(),
    }
}

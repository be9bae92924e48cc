//! How long a handler may take.

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

/// Answers `Busy` when a handler takes longer than `patience`.
#[boxed]
pub async fn time_out(State(patience): State<Duration>, request: Request, next: Next) -> Response {
    match tokio::time::timeout(patience, next.run(request)).await {
        Ok(response) => response,
        Err(_) => Problem::new(
            ProblemKind::Busy,
            format!(
                "the answer took longer than {} s; try again later",
                patience.as_secs_f64()
            ),
        )
        .into_response(),
    }
}

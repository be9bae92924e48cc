//! Limits the requests in flight. Under overload requests are refused at once, and those that only read are refused first.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};
use faceoff_api::paths::LIVE_PATH;
use faceoff_service::{
    app::AppState,
    problem::{Problem, ProblemKind},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use tokio::sync::Semaphore;

/// With fewer requests in flight none is refused for its waiting time: their number is then not the cause.
const MIN_CROWD: usize = 64;
/// A request that waits longer than this for the other ready ones would be answered late, and would delay more of them.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Requests that are being answered.
#[derive(Debug, Clone)]
pub(crate) struct InFlight {
    app: Arc<AppState>,
    permits: Arc<Semaphore>,
}

impl InFlight {
    pub(crate) fn new(app: &Arc<AppState>) -> Self {
        Self {
            app: Arc::clone(app),
            permits: Arc::new(Semaphore::new(app.config.limits.requests)),
        }
    }

    fn is_crowded(&self) -> bool {
        let limit = self.app.config.limits.requests;
        limit.saturating_sub(self.permits.available_permits()) >= MIN_CROWD
    }

    fn refuse(&self, cause: &'static str) -> Response {
        self.app.config.metrics.web().record_refusal(cause);
        Problem::new(
            ProblemKind::Busy,
            "the server is at its limit of requests in flight; try again in 2 s",
        )
        .into_response()
    }
}

/// Answers `Busy` when the limit is reached. Requests that only read are also refused when too many others are ready.
pub(crate) async fn limit(
    State(in_flight): State<InFlight>,
    request: Request,
    next: Next,
) -> Response {
    // A busy server is alive.
    if request.uri().path() == LIVE_PATH {
        return next.run(request).await;
    }
    let Ok(_permit) = in_flight.permits.try_acquire() else {
        return in_flight.refuse("in_flight");
    };
    if request.method().is_safe() {
        // All other ready requests run before this one continues, so the elapsed time is the delay that they cause.
        let started = Instant::now();
        tokio::task::yield_now().await;
        if started.elapsed() > MAX_WAIT && in_flight.is_crowded() {
            return in_flight.refuse("late");
        }
    }
    next.run(request).await
}

//! Limits the number of requests in flight, which are those that the server is answering. Under overload it refuses requests
//! at once: first visitors' requests that only read, then those of all visitors, then those of teams, and last those of organisers.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};
use faceoff_api::paths::{LIVE_PATH, READY_PATH};
use faceoff_service::{
    app::AppState,
    priority_permits::{Precedence, PriorityPermits},
    problem::{Problem, ProblemKind},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// With fewer requests in flight, no request is refused because of its wait: so few requests do not cause a long wait.
const MIN_CROWDED_REQUESTS: usize = 64;
/// Longest time that a visitor's reading request may wait until the async runtime continues it. After a longer wait it is refused.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Most readiness probes in flight. A load balancer sends one at a time.
const MAX_PROBES: usize = 16;

/// Counts the requests in flight.
#[derive(Debug, Clone)]
pub(crate) struct InFlight {
    app: Arc<AppState>,
    /// One for each request in flight.
    permits: PriorityPermits,
    /// One for each readiness probe in flight. Anyone can send probes, so they must not use up the permits of other requests.
    probes: PriorityPermits,
}

impl InFlight {
    pub(crate) fn new(app: &Arc<AppState>) -> Self {
        Self {
            app: Arc::clone(app),
            permits: PriorityPermits::new(app.config.limits.requests),
            probes: PriorityPermits::new(MAX_PROBES),
        }
    }

    /// The response to a refused request. `cause` is its label in the metrics.
    fn refuse(&self, cause: &'static str) -> Response {
        self.app.config.metrics.web().record_refusal(cause);
        Problem::new(
            ProblemKind::Busy,
            "the server is at its limit of requests in flight; try again in 2 s",
        )
        .into_response()
    }
}

/// Answers `Busy` when the limit for the caller's precedence is reached. Visitors' requests that only read also get `Busy` after a wait
/// longer than [`MAX_WAIT`].
pub(crate) async fn limit(
    State(in_flight): State<InFlight>,
    request: Request,
    next: Next,
) -> Response {
    // The liveness probe is always answered: a busy server is alive.
    if request.uri().path() == LIVE_PATH {
        return next.run(request).await;
    }
    // A load balancer stops sending requests to a server that is not ready, those of teams and organisers, too. So probes are
    // refused last.
    if request.uri().path() == READY_PATH {
        let probe = in_flight.probes.take(Precedence::Organiser);
        // A server that has no permit left even for organisers is not ready.
        let is_full = in_flight.permits.take(Precedence::Organiser).is_none();
        if probe.is_none() || is_full {
            return in_flight.refuse("in_flight");
        }
        return next.run(request).await;
    }
    let precedence = in_flight.app.precedence(request.headers());
    let Some(_permit) = in_flight.permits.take(precedence) else {
        return in_flight.refuse("in_flight");
    };
    if request.method().is_safe() && precedence == Precedence::Visitor {
        // The runtime polls all other ready tasks before this one continues, so the elapsed time is the delay that they cause.
        let yielded_at = Instant::now();
        tokio::task::yield_now().await;
        if yielded_at.elapsed() > MAX_WAIT && in_flight.permits.taken() >= MIN_CROWDED_REQUESTS {
            return in_flight.refuse("late");
        }
    }
    next.run(request).await
}

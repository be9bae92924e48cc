//! How many requests are answered at a time, and which are refused when there are too many: quickly, and those first that
//! only look on.

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

/// With fewer than this under way nobody is refused, however long they wait: it is then not for their number.
const FEW: usize = 64;
/// Who has waited longer than this for the others that are ready would get its answer late, and make more wait.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// Requests that are being answered.
#[derive(Debug, Clone)]
pub(crate) struct InFlight {
    app: Arc<AppState>,
    places: Arc<Semaphore>,
}

impl InFlight {
    pub(crate) fn new(app: &Arc<AppState>) -> Self {
        Self {
            app: Arc::clone(app),
            places: Arc::new(Semaphore::new(app.config.limits.requests)),
        }
    }

    fn are_many(&self) -> bool {
        let most = self.app.config.limits.requests;
        most.saturating_sub(self.places.available_permits()) >= FEW
    }

    fn refuse(&self, because: &'static str) -> Response {
        self.app.config.metrics.web().refused(because);
        Problem::new(
            ProblemKind::Busy,
            "the server answers as many requests as it may at once; try again in 2 s",
        )
        .into_response()
    }
}

/// Answers `Busy` where there is no place, and to whoever changes nothing where too many are ready to be answered.
pub(crate) async fn limit(
    State(in_flight): State<InFlight>,
    request: Request,
    next: Next,
) -> Response {
    // A server that has much to do is not dead.
    if request.uri().path() == LIVE_PATH {
        return next.run(request).await;
    }
    let Ok(_place) = in_flight.places.try_acquire() else {
        return in_flight.refuse("in_flight");
    };
    if request.method().is_safe() {
        // All that are ready have their turn before this one goes on: they are counted, and how long they take is measured.
        let began = Instant::now();
        tokio::task::yield_now().await;
        if began.elapsed() > LONGEST_WAIT && in_flight.are_many() {
            return in_flight.refuse("late");
        }
    }
    next.run(request).await
}

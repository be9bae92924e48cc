//! Probes for monitoring: liveness, readiness and metrics. They have their conventional paths, outside of the API's versions.

use axum::{
    Json, Router,
    extract::State,
    http::{HeaderMap, header},
    middleware,
    response::IntoResponse,
    routing::get,
};
use faceoff_api::{
    paths::{LIVE_PATH, READY_PATH},
    views::health::{HealthView, LiveView},
};
use faceoff_metrics::{Disk, Format, GaugeValues, Queue};
use faceoff_service::{
    app::{App, AppState},
    auth::Organiser,
    problem::Problem,
    timeouts,
    views::{health, queue, workers},
};
use std::time::Duration;

/// The probes on the public address. The metrics need an organiser's token: they show how full the disks are, and so how much
/// teams upload.
pub(crate) fn router(timeout: Duration) -> Router<App> {
    with_probes(Router::new().route("/metrics", get(metrics)), timeout)
}

/// The probes on an address that only the operators reach. None needs a token.
pub(crate) fn unauthenticated_router(timeout: Duration) -> Router<App> {
    with_probes(
        Router::new().route("/metrics", get(unauthenticated_metrics)),
        timeout,
    )
}

fn with_probes(router: Router<App>, timeout: Duration) -> Router<App> {
    router
        .route(LIVE_PATH, get(live))
        .route(READY_PATH, get(ready))
        .layer(middleware::from_fn_with_state(timeout, timeouts::time_out))
}

async fn live() -> Json<LiveView> {
    Json(LiveView::ALIVE)
}

async fn ready(State(app): State<App>) -> Result<Json<HealthView>, Problem> {
    health::check(&app).await.map(Json)
}

async fn metrics(
    _: Organiser,
    app: State<App>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    unauthenticated_metrics(app, headers).await
}

async fn unauthenticated_metrics(
    State(app): State<App>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let accept = headers.get(header::ACCEPT);
    let format = Format::accepted(accept.and_then(|accept| accept.to_str().ok()));
    let text = app.config.metrics.text(format, &gauges(&app).await?);
    let text = text.map_err(Problem::internal)?;
    Ok(([(header::CONTENT_TYPE, format.media_type())], text))
}

async fn gauges(app: &AppState) -> Result<GaugeValues, Problem> {
    let now = app.config.clock.now();
    let free_space = app.store.free_space();
    let gauges = app.store.gauges(now).await?;
    let seconds_since = |since| now.duration_since(since).as_secs_f64().max(0.0);
    let completed_at = queue::forecast(app).await?.completed_at(now);
    let disks = ["data", "scratch"].into_iter().zip(free_space.disks());
    Ok(GaugeValues {
        database_writable: app.store.health(now).await.database_writable,
        queue: Queue {
            running: gauges.running,
            waiting: gauges.waiting,
            out_of_space: gauges.out_of_space,
            paused: gauges.paused || free_space.is_short(),
            oldest_wait_s: gauges.waiting_since.map_or(0.0, seconds_since),
            expected_s: completed_at.map_or(f64::NAN, |completed_at| {
                completed_at.duration_since(now).as_secs_f64()
            }),
        },
        clock_step_s: app
            .config
            .clock
            .step()
            .map_or(0.0, |step| step.by.as_secs_f64()),
        open_evaluations: gauges.open_evaluations,
        slots: app.config.capacity.slots,
        remote_slots: app.live.workers.available_slots(now),
        remote_workers: app
            .live
            .workers
            .all()
            .iter()
            .filter(|worker| worker.is_online(now))
            .count(),
        long_remote_jobs: workers::current(app).alarms.len(),
        disks: disks
            .filter_map(|(name, space)| {
                space.map(|space| Disk {
                    name,
                    free_bytes: space.free_bytes,
                    size_bytes: space.size_bytes,
                })
            })
            .collect(),
        process: (app.config.process)(),
    })
}

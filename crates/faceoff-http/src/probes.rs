//! What watches the server asks here: does it live, is it ready, and its numbers. By the names that such programs look for,
//! outside of the API's versions.

use axum::{
    Json, Router, extract::State, http::header, middleware, response::IntoResponse, routing::get,
};
use faceoff_api::{
    paths::LIVE_PATH,
    views::health::{HealthView, LiveView},
};
use faceoff_metrics::{Disk, MEDIA_TYPE, Queue, Standing};
use faceoff_service::{
    app::{App, AppState},
    auth::Organiser,
    problem::Problem,
    timeouts,
    views::{health, queue, workers},
};
use std::time::Duration;

/// For everybody, but the numbers: they tell how full the disks are, and so how much teams upload.
pub(crate) fn router(patience: Duration) -> Router<App> {
    around(Router::new().route("/metrics", get(numbers)), patience)
}

/// Where strangers do not come.
pub(crate) fn open_router(patience: Duration) -> Router<App> {
    around(Router::new().route("/metrics", get(open_numbers)), patience)
}

fn around(router: Router<App>, patience: Duration) -> Router<App> {
    router
        .route(LIVE_PATH, get(alive))
        .route("/readyz", get(ready))
        .layer(middleware::from_fn_with_state(patience, timeouts::time_out))
}

async fn alive() -> Json<LiveView> {
    Json(LiveView::ALIVE)
}

async fn ready(State(app): State<App>) -> Result<Json<HealthView>, Problem> {
    health::now(&app).await.map(Json)
}

async fn numbers(_: Organiser, app: State<App>) -> Result<impl IntoResponse, Problem> {
    open_numbers(app).await
}

async fn open_numbers(State(app): State<App>) -> Result<impl IntoResponse, Problem> {
    let text = app.config.metrics.text(&standing(&app).await?);
    let text = text.map_err(Problem::internal)?;
    Ok(([(header::CONTENT_TYPE, MEDIA_TYPE)], text))
}

async fn standing(app: &AppState) -> Result<Standing, Problem> {
    let now = app.config.clock.now();
    let room = app.store.room();
    let numbers = app.store.numbers(now).await?;
    let waited = |since| now.duration_since(since).as_secs_f64().max(0.0);
    let over_at = queue::outlook(app).await?.over_at(now);
    let disks = ["data", "scratch"].into_iter().zip(room.disks());
    Ok(Standing {
        database_writable: app.store.health(now).await.database_writable,
        queue: Queue {
            running: numbers.running,
            waiting: numbers.waiting,
            without_room: numbers.without_room,
            paused: numbers.held || room.is_short(),
            oldest_wait_s: numbers.waiting_since.map_or(0.0, waited),
            expected_s: over_at.map_or(f64::NAN, |at| at.duration_since(now).as_secs_f64()),
        },
        open_evaluations: numbers.open_evaluations,
        slots: app.config.capacity.slots,
        remote_slots: app.store.workers().slots(now),
        remote_workers: app
            .store
            .workers()
            .all()
            .iter()
            .filter(|worker| worker.is_there(now))
            .count(),
        remote_long: workers::now(app).alarms.len(),
        disks: disks
            .filter_map(|(of, space)| {
                space.map(|space| Disk {
                    of,
                    free_bytes: space.free_bytes,
                    size_bytes: space.size_bytes,
                })
            })
            .collect(),
        process: (app.config.process)(),
    })
}

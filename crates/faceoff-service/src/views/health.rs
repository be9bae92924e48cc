//! Is the server up, and is it fit for work?

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    views::{ruling, workers},
};
use faceoff_api::views::health::HealthView;
use faceoff_store::QueueHealth;

/// What there is to say if nothing is missing: the database can be written (it is tried, once a second at most), the
/// queue moves, and the disks have room.
///
/// # Errors
/// [`ProblemKind::NotReady`], whose `database`, `queue` and `room` say what is missing.
#[boxed]
pub async fn now(app: &AppState) -> Result<HealthView, Problem> {
    let room = app.store.room();
    let short = room.is_short();
    let health = app.store.health(app.config.clock.now()).await;
    let without_room = match health.queue {
        QueueHealth::Moving { without_room, .. } => without_room,
        _ => 0,
    };
    let (running, waiting, queue) = match health.queue {
        QueueHealth::Moving {
            running, waiting, ..
        } => (running, waiting, "moving"),
        QueueHealth::Held {
            running, waiting, ..
        } => (running, waiting, "held"),
        QueueHealth::Paused { waiting } => (0, waiting, "paused"),
        QueueHealth::Stuck { waiting, .. } => (0, waiting, "stuck"),
        QueueHealth::Unknown => (0, 0, "unknown"),
    };
    let mut missing = Vec::new();
    if !health.database_writable {
        missing.push("the database cannot be written".to_owned());
    }
    if short {
        missing.push(format!(
            "less than {} bytes are free on the disk, so the queue pauses and uploads are refused",
            room.min_free_bytes()
        ));
    }
    if without_room > 0 {
        missing.push(format!(
            "{without_room} units of work found no room again and again although the disk has what is to be kept \
             free: they need more than that; they are tried on"
        ));
    }
    match &health.queue {
        QueueHealth::Stuck { waiting, since } => {
            missing.push(format!(
                "{waiting} units of work wait, the first since {since}, and nobody works"
            ));
        }
        QueueHealth::Unknown => missing.push("the queue cannot be read".to_owned()),
        QueueHealth::Moving { .. } | QueueHealth::Held { .. } | QueueHealth::Paused { .. } => {}
    }
    for slot in app.config.metrics.slots().standing_still() {
        missing.push(format!(
            "{slot} stands still: something on this host holds it although its agent was ended; restart the server"
        ));
    }
    if app.config.capacity.slots == 0 {
        missing.extend(elsewhere(app, waiting));
    }
    if missing.is_empty() {
        return Ok(HealthView {
            status: "ok".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            running,
            waiting,
            paused: match health.queue {
                QueueHealth::Held { ruling, .. } => Some(ruling::of(ruling)),
                _ => None,
            },
        });
    }
    // How much is free exactly would tell every team how large the others' uploads are.
    Err(Problem::new(ProblemKind::NotReady, missing.join("; "))
        .with(
            "database",
            if health.database_writable {
                "writable"
            } else {
                "not writable"
            },
        )
        .with("queue", queue)
        .with(
            "room",
            match (short, without_room > 0) {
                (true, _) => "short",
                (false, true) => "too little for some work",
                (false, false) => "enough",
            },
        )
        .with("min_free_bytes", room.min_free_bytes())
        .with("waiting", waiting))
}

/// What is missing where others play.
fn elsewhere(app: &AppState, waiting: u32) -> Vec<String> {
    let workers = workers::now(app);
    let mut missing = workers.troubles;
    if workers.remote_slots == 0 && waiting > 0 {
        missing.push(format!(
            "{waiting} units of work wait, the server's own slots do not play, and no worker elsewhere can be given any"
        ));
    }
    missing
}

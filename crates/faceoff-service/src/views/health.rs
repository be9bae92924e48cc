//! Health check: whether the server is ready, that is, whether database, queue, disks and clock work.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    views::{decision, workers},
};
use faceoff_api::views::health::HealthView;
use faceoff_store::QueueHealth;

/// Checks that the database is writable (by a test write, at most once a second), the queue makes progress, the disks have free
/// space, and the system clock was not set.
///
/// # Errors
/// [`ProblemKind::NotReady`]; its `database`, `queue`, `free_space` and `clock` say what is wrong.
#[boxed_future]
pub async fn check(app: &AppState) -> Result<HealthView, Problem> {
    let free_space = app.store.free_space();
    let is_short = free_space.is_short();
    let health = app.store.health(app.config.clock.now()).await;
    let out_of_space_jobs = match health.queue {
        QueueHealth::Running { out_of_space, .. } => out_of_space,
        _ => 0,
    };
    // These words are promised to monitoring: "held" is a pause by an organiser, "paused" a lack of disk space.
    let (running, waiting, queue_state) = match health.queue {
        QueueHealth::Running {
            running, waiting, ..
        } => (running, waiting, "moving"),
        QueueHealth::Paused {
            running, waiting, ..
        } => (running, waiting, "held"),
        QueueHealth::DiskFull { waiting } => (0, waiting, "paused"),
        QueueHealth::Stuck { waiting, .. } => (0, waiting, "stuck"),
        QueueHealth::Unknown => (0, 0, "unknown"),
    };
    let mut problems = Vec::new();
    if !health.database_writable {
        problems.push("the database cannot be written".to_owned());
    }
    let clock_step = app.config.clock.step();
    problems.extend(clock_step.map(|step| step.to_string()));
    if is_short {
        problems.push(format!(
            "less than {} bytes are free on the disk, so the queue pauses and uploads are refused",
            free_space.min_free_bytes()
        ));
    }
    if out_of_space_jobs > 0 {
        problems.push(format!(
            "{out_of_space_jobs} jobs repeatedly lacked disk space although the configured minimum is free: they need more; \
             the server keeps trying"
        ));
    }
    match &health.queue {
        QueueHealth::Stuck { waiting, since } => {
            problems.push(format!(
                "{waiting} jobs are pending, the first since {since}, and none is running"
            ));
        }
        QueueHealth::Unknown => problems.push("the queue cannot be read".to_owned()),
        QueueHealth::Running { .. } | QueueHealth::Paused { .. } | QueueHealth::DiskFull { .. } => {
        }
    }
    for slot in app.config.metrics.slots().stuck() {
        problems.push(format!(
            "{slot} is stuck: a process on this host blocks it although its agent was killed; restart the server"
        ));
    }
    if app.config.capacity.slots == 0 {
        problems.extend(remote_problems(app, waiting));
    }
    if problems.is_empty() {
        return Ok(HealthView {
            status: "ok".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            running,
            waiting,
            paused: match health.queue {
                QueueHealth::Paused { decision, .. } => Some(decision::view(decision)),
                _ => None,
            },
        });
    }
    // The exact free space would reveal to every team how large the others' uploads are.
    Err(Problem::new(ProblemKind::NotReady, problems.join("; "))
        .with(
            "database",
            if health.database_writable {
                "writable"
            } else {
                "not writable"
            },
        )
        .with("queue", queue_state)
        .with_renamed(
            "free_space",
            "room",
            match (is_short, out_of_space_jobs > 0) {
                (true, _) => "short",
                (false, true) => "too little for some work",
                (false, false) => "enough",
            },
        )
        .with(
            "clock",
            if clock_step.is_some() {
                "set"
            } else {
                "steady"
            },
        )
        .with("min_free_bytes", free_space.min_free_bytes())
        .with("waiting", waiting))
}

/// Problems of a server whose jobs run on remote workers only. Their causes name addresses and workers, which only organisers see.
fn remote_problems(app: &AppState, waiting: u32) -> Vec<String> {
    let workers = workers::current(app);
    let mut problems = Vec::new();
    if !workers.problems.is_empty() {
        problems.push(
            "remote workers and the server cannot exchange jobs or results; organisers see the cause (GET /api/v1/workers)"
                .to_owned(),
        );
    }
    if workers.remote_slots == 0 && waiting > 0 {
        problems.push(format!(
            "{waiting} jobs are pending, the server has no slots of its own, and no remote worker can lease them"
        ));
    }
    problems
}

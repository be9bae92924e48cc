//! A step (sudden change) of the system clock. The server continues its own time until an organiser accepts the step, because the new
//! time is correct.

use super::decision_preview::Preview;
use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_store::Actor;
use faceoff_types::ClockStep;
use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// After the step each lease lasts at least this long, because some were renewed according to the old time.
const MIN_LEASE_S: u32 = 60;

/// The step that is not accepted yet.
fn current_step(app: &AppState) -> Result<ClockStep, Problem> {
    app.config.clock.step().ok_or_else(|| {
        Problem::new(
            ProblemKind::Conflict,
            "the system clock has no step that could be accepted: it agrees with the server\u{2019}s time",
        )
    })
}

/// Preview of accepting the step of the system clock. Its size is the name that confirms it.
///
/// # Errors
/// `Conflict` if there is no step.
pub fn preview_accepted_step(app: &AppState) -> Result<Preview, Problem> {
    Ok(preview(&current_step(app)?))
}

fn preview(step: &ClockStep) -> Preview {
    let server_at = step.server_at + step.shift();
    Preview {
        name: step.size(),
        effect: format!(
            "{step}. If you accept it, the server\u{2019}s time will be {server_at:.0}. Cutoffs, deadlines and closing times until \
             then will take effect at once; this cannot be undone. Leases and retries of jobs will move with the clock"
        ),
    }
}

/// Accepts the step of the system clock, if that is confirmed with its size.
#[boxed_future]
pub async fn accept_step(
    app: &AppState,
    actor: Actor,
    confirmed: Option<&str>,
) -> Result<(), Problem> {
    let step = current_step(app)?;
    preview(&step).check_confirmed(confirmed)?;
    let clock = app.config.clock.clone();
    let (size, now) = (step.size(), step.server_at + step.shift());
    let is_accepted = Arc::new(AtomicBool::new(false));
    let is_accepted_in_store = Arc::clone(&is_accepted);
    // The store calls this in its transaction, which may still fail afterwards.
    let accept = Box::new(move || {
        is_accepted_in_store.store(clock.accept(&step), Ordering::SeqCst);
        is_accepted_in_store.load(Ordering::SeqCst)
    });
    let stored = app
        .store
        .accept_clock_step(actor, step.shift(), size, now, accept);
    if let Err(error) = stored.await {
        // Leases and due times were not moved in the database, so the clock must not have moved either.
        if is_accepted.load(Ordering::SeqCst) {
            app.config.clock.revert(&step);
        }
        return Err(error.into());
    }
    let now = app.config.clock.now();
    app.store.renew_all_leases(MIN_LEASE_S, now).await?;
    tracing::info!(
        step = step.size(),
        "the step of the system clock was accepted"
    );
    Ok(())
}

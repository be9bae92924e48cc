//! The end of a stage: freezing its boards, starting its final evaluation day, and signing its result off. A *frozen* board
//! shows no later results; after the *sign-off* the result cannot change any more.

use super::decision_preview::{Preview, checked_reason};
use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{Actor, Stage, StoreError};
use faceoff_types::{StageDay, StageId};

/// Freezes a stage's boards: later results do not appear on them.
#[boxed_future]
pub async fn freeze_boards(
    app: &AppState,
    actor: Actor,
    id: StageId,
    reason: &str,
) -> Result<(), Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.freeze_boards(actor, id, reason, now).await?;
    tracing::info!(stage = %id, reason, "boards frozen");
    Ok(())
}

/// Unfreezes a stage's boards.
#[boxed_future]
pub async fn unfreeze_boards(app: &AppState, actor: Actor, id: StageId) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.unfreeze_boards(actor, id, now).await?;
    tracing::info!(stage = %id, "boards unfrozen");
    Ok(())
}

/// Starts a stage's final day, and returns it. This is possible once, after the stage has closed.
#[boxed_future]
pub async fn start_final_day(
    app: &AppState,
    actor: Actor,
    id: StageId,
) -> Result<StageDay, Problem> {
    let now = app.config.clock.now();
    let stage = app.store.stage(id).await?;
    let result = app.store.start_final_day(actor, id, now).await;
    let created = result.map_err(|error| match error {
        StoreError::CutoffPassed { day, cutoff_at } => Problem::new(
            ProblemKind::CutoffPassed,
            format!(
                "{day} had its cutoff at {}, and a date has only one; nothing was started. The final day needs a date of its \
                 own: start it on the next date in {}",
                cutoff_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                stage.zone
            ),
        )
        .with("day", day.to_string())
        .with_renamed("cutoff_at", "cut_at", cutoff_at.to_string()),
        error => error.into(),
    })?;
    tracing::info!(stage = %stage.name, evaluations = created.len(), "the final day was started");
    Ok(stage.day(now))
}

/// Preview of signing a stage off, if that is possible now.
#[boxed_future]
pub async fn preview_sign_off(app: &AppState, id: StageId) -> Result<Preview, Problem> {
    let now = app.config.clock.now();
    let stage = app.store.check_can_sign_off(id, now).await?;
    let name = stage.name.to_string();
    let effect = format!(
        "the result of the stage {name:?} will be signed off for good. Its evaluations can no longer be voided or repeated, \
         and its settings can no longer be changed. Later disqualifications or reinstatements will not affect its boards"
    );
    Ok(Preview { name, effect })
}

/// Signs a stage's result off, if that is confirmed with the stage's name.
#[boxed_future]
pub async fn sign_off_stage(
    app: &AppState,
    actor: Actor,
    id: StageId,
    confirm: Option<&str>,
) -> Result<Stage, Problem> {
    preview_sign_off(app, id).await?.check_confirmed(confirm)?;
    let now = app.config.clock.now();
    let signed_off = app.store.sign_off_stage(actor, id, now).await?;
    tracing::info!(stage = %signed_off.name, %id, "stage signed off");
    Ok(signed_off)
}

//! Boards that stand still, a stage's final day, and the signing off of its result.

use super::deciding::{Stake, checked_reason};
use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    views::{day, stage},
};
use faceoff_api::views::{day::DayView, stage::StageView};
use faceoff_store::{Actor, StoreError};
use faceoff_types::StageId;

/// Has the boards of a stage show what they show now.
#[boxed]
pub async fn freeze_boards(
    app: &AppState,
    actor: Actor,
    id: StageId,
    reason: &str,
) -> Result<StageView, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.freeze_boards(actor, id, reason, now).await?;
    tracing::info!(stage = %id, reason, "boards frozen");
    stage::find(app, id).await
}

/// Has the boards of a stage show all results again.
#[boxed]
pub async fn unfreeze_boards(
    app: &AppState,
    actor: Actor,
    id: StageId,
) -> Result<StageView, Problem> {
    let now = app.config.clock.now();
    app.store.unfreeze_boards(actor, id, now).await?;
    tracing::info!(stage = %id, "boards unfrozen");
    stage::find(app, id).await
}

/// Starts a stage's final day, once, after its close.
#[boxed]
pub async fn start_final_day(
    app: &AppState,
    actor: Actor,
    id: StageId,
) -> Result<DayView, Problem> {
    let now = app.config.clock.now();
    let stage = app.store.stage(id).await?;
    let started = app.store.start_final_day(actor, id, now).await;
    let created = started.map_err(|error| match error {
        StoreError::DayHasCut { day, cut_at } => Problem::new(
            ProblemKind::DayHasCut,
            format!(
                "{day} had its cut at {}, and a date has one; nothing was started. The final day needs a date of its \
                 own: start it when the next one has begun in {}",
                cut_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                stage.zone
            ),
        )
        .with("day", day.to_string())
        .with("cut_at", cut_at.to_string()),
        error => error.into(),
    })?;
    tracing::info!(stage = %stage.name, evaluations = created.len(), "the final day was started");
    day::of(app, stage.day(now)).await
}

/// What signing a stage off would do, if it can be now.
#[boxed]
pub async fn at_stake_of_stage(app: &AppState, id: StageId) -> Result<Stake, Problem> {
    let now = app.config.clock.now();
    let stage = app.store.check_stage_settled(id, now).await?;
    let name = stage.name.to_string();
    let what = format!(
        "the result of the stage {name:?} would be signed off for good. None of its evaluations could be voided or \
         played again, none of its settings changed, and who is disqualified or reinstated later would not change its \
         boards"
    );
    Ok(Stake { name, what })
}

/// Signs the result of a stage off, once that is confirmed.
#[boxed]
pub async fn finalise_stage(
    app: &AppState,
    actor: Actor,
    id: StageId,
    confirm: Option<&str>,
) -> Result<StageView, Problem> {
    at_stake_of_stage(app, id).await?.check(confirm)?;
    let now = app.config.clock.now();
    let done = app.store.finalise_stage(actor, id, now).await?;
    tracing::info!(stage = %done.name, %id, "stage signed off");
    stage::of(app, done).await
}

//! Decisions of organisers about games of a round: voiding a result, and rerunning a game.

use super::decision_preview::{Preview, checked_reason, reason_sentence};
use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    viewer::Viewer,
    views::{game, tournament_state::TournamentState},
};
use faceoff_api::requests::Decision;
use faceoff_store::{Actor, Game};
use faceoff_types::GameId;

/// The names of both teams of a game, the home team first; they confirm decisions about it.
pub fn pairing_name(state: &TournamentState, game: &Game) -> Result<String, Problem> {
    let [home, away] = game.teams;
    Ok(format!("{} - {}", state.name(home)?, state.name(away)?))
}

/// Preview of voiding the result of a game.
#[boxed_future]
pub async fn preview_void_game(
    app: &AppState,
    id: GameId,
    reason: Option<&str>,
) -> Result<Preview, Problem> {
    let (state, game) = game::find_visible(app, Viewer::Organiser, id).await?;
    let name = pairing_name(&state, &game)?;
    let effect = format!(
        "the result of {name} will be voided at once. The next round will wait until the game is rerun with the same seed \
         and submissions. {}",
        reason_sentence(reason)
    );
    Ok(Preview { name, effect })
}

/// Voids the result of a game, if that is confirmed with the names of its teams.
#[boxed_future]
pub async fn void_game(
    app: &AppState,
    actor: Actor,
    id: GameId,
    decision: &Decision,
) -> Result<Game, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let preview = preview_void_game(app, id, Some(reason)).await?;
    preview.check_confirmed(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let voided = app.store.void_game(actor, id, reason, now).await?;
    tracing::info!(game = %id, reason, "game voided");
    Ok(voided)
}

/// Reruns a game that was voided or failed by a platform fault, with the same submissions and the same seed.
#[boxed_future]
pub async fn rerun_game(app: &AppState, actor: Actor, id: GameId) -> Result<Game, Problem> {
    game::find_visible(app, Viewer::Organiser, id).await?;
    let now = app.config.clock.now();
    let queued = app.store.rerun_game(actor, id, now).await?;
    tracing::info!(game = %id, "game is rerun");
    Ok(queued)
}

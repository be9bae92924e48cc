//! Decisions about a game of a tournament: void its result, or rerun it.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON};
use crate::organiser::tournament::page_path;
use faceoff_api::requests;
use faceoff_service::{
    app::AppState, problem::Problem, services::games, viewer::Viewer, views::game,
};
use faceoff_store::Actor;
use faceoff_types::GameId;

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum GameDecision {
    Void(GameId),
    Rerun(GameId),
}

impl GameDecision {
    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Void(id) => {
                let return_path = page_path(app.store.game(id).await?.tournament);
                let effects = games::preview_void_game(app, id, None).await?;
                Ok(DecisionPreview {
                    title: format!("Void the result of {}", effects.name),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Void the result",
                    ..DecisionPreview::needing_confirmation(effects, return_path)
                })
            }
            Self::Rerun(id) => {
                let (state, game) = game::find_visible(app, Viewer::Organiser, id).await?;
                Ok(DecisionPreview {
                    title: format!("Rerun {}", games::pairing_name(&state, &game)?),
                    effects:
                        "The game will be queued again, with the same submissions and the same seed."
                            .to_owned(),
                    button: "Rerun the game",
                    ..DecisionPreview::new(page_path(game.tournament))
                })
            }
        }
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let (game, notice) = match self {
            Self::Void(id) => {
                let voided = games::void_game(app, actor, id, &request).await?;
                (voided, "game-voided")
            }
            Self::Rerun(id) => (games::rerun_game(app, actor, id).await?, "game-rerun"),
        };
        Ok(DecisionOutcome::new(notice, page_path(game.tournament)))
    }
}

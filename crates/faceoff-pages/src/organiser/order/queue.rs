//! Decisions about the queue.

use super::sheet::{EVERYBODY, Sheet};
use crate::figures::minute;
use faceoff_api::requests::Decision;
use faceoff_service::{acts::rulings, app::AppState, problem::Problem, views::ruling};
use faceoff_store::Actor;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::organiser) enum QueueOrder {
    Pause,
    Resume,
}

impl QueueOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "pause" if of.is_empty() => Self::Pause,
            "resume" if of.is_empty() => Self::Resume,
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
        let paused = app.store.season().await?.paused.map(ruling::of);
        let back = "/organiser/day".to_owned();
        if self == Self::Pause {
            return Ok(Sheet {
                title: "Pause the queue".to_owned(),
                what: "Nothing new is begun. What is begun is played to its end; days start, and wait. Every page says \
                       that the queue is paused, and why."
                    .to_owned(),
                reason: Some(EVERYBODY),
                confirm: None,
                button: "Pause",
                is_grave: false,
                back,
            });
        }
        let since = paused.map_or_else(
            || "The queue is not paused.".to_owned(),
            |ruling| {
                format!(
                    "The queue is paused since {} ({}).",
                    minute(ruling.at),
                    ruling.reason
                )
            },
        );
        Ok(Sheet {
            title: "Let the queue go on".to_owned(),
            what: format!("{since} What waits is begun at once."),
            reason: None,
            confirm: None,
            button: "Go on",
            is_grave: false,
            back,
        })
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        let reason = decision.reason.as_str();
        match self {
            Self::Pause => {
                rulings::pause_queue(app, actor, reason).await?;
                Ok("paused")
            }
            Self::Resume => {
                rulings::resume_queue(app, actor).await?;
                Ok("resumed")
            }
        }
    }
}

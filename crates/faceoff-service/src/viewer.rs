//! Who looks at what everybody may look at: nobody needs a token, and the organiser's shows more.

use crate::{
    app::App,
    auth::{Anybody, Caller},
    problem::{Problem, ProblemKind},
};
use axum::{extract::FromRequestParts, http::request::Parts};
use faceoff_notify::Reader;
use faceoff_types::TeamId;

/// A caller, with or without a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Viewer {
    Organiser,
    /// Who speaks for a team.
    Team(TeamId),
    Anybody,
}

impl Viewer {
    /// Of a caller with a token.
    pub fn of(caller: &Caller) -> Self {
        match caller.team() {
            None => Self::Organiser,
            Some(team) => Self::Team(team.id),
        }
    }

    /// What it is to ask for something of others: whoever has not said who they are is asked that first.
    pub const fn refusal(self) -> ProblemKind {
        match self {
            Self::Anybody => ProblemKind::Unauthenticated,
            Self::Team(_) | Self::Organiser => ProblemKind::Forbidden,
        }
    }

    /// Refuses everybody but organisers, of whom `what` is.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`.
    pub(crate) fn check_organiser(self, what: &str) -> Result<(), Problem> {
        if self == Self::Organiser {
            return Ok(());
        }
        Err(Problem::new(
            self.refusal(),
            format!("{what} is for the organiser: it needs the organiser's token"),
        ))
    }
}

impl From<Caller> for Viewer {
    fn from(caller: Caller) -> Self {
        Self::of(&caller)
    }
}

impl From<Viewer> for Reader {
    fn from(viewer: Viewer) -> Self {
        match viewer {
            Viewer::Organiser => Self::Organiser,
            Viewer::Team(team) => Self::Team(team),
            Viewer::Anybody => Self::Anybody,
        }
    }
}

impl FromRequestParts<App> for Viewer {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let Anybody(caller) = Anybody::from_request_parts(parts, app).await?;
        Ok(caller.as_ref().map_or(Self::Anybody, Self::of))
    }
}

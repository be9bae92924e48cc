//! The viewer of a public resource: an organiser, a team, or a visitor without a token. Organisers and teams may see more.

use crate::{
    app::App,
    auth::{Caller, OptionalCaller},
    problem::{Problem, ProblemKind},
};
use axum::{extract::FromRequestParts, http::request::Parts};
use faceoff_notify::Audience;
use faceoff_types::TeamId;

/// The caller of a public resource, with or without a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Viewer {
    Organiser,
    /// A member of a team, or an API client with its token.
    Team(TeamId),
    Visitor,
}

impl Viewer {
    /// The viewer that a caller with a token is.
    pub fn new(caller: &Caller) -> Self {
        match caller.team() {
            None => Self::Organiser,
            Some(team) => Self::Team(team.id),
        }
    }

    /// The kind of problem for a resource that the viewer may not see. A visitor is asked to authenticate first.
    pub const fn denial_kind(self) -> ProblemKind {
        match self {
            Self::Visitor => ProblemKind::Unauthenticated,
            Self::Team(_) | Self::Organiser => ProblemKind::Forbidden,
        }
    }

    /// Refuses all viewers but organisers; `resource` is its name in the message.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`.
    pub(crate) fn check_organiser(self, resource: &str) -> Result<(), Problem> {
        if self == Self::Organiser {
            return Ok(());
        }
        Err(Problem::new(
            self.denial_kind(),
            format!("{resource} is for organisers only: it needs an organiser's token"),
        ))
    }
}

impl From<Caller> for Viewer {
    fn from(caller: Caller) -> Self {
        Self::new(&caller)
    }
}

impl From<Viewer> for Audience {
    fn from(viewer: Viewer) -> Self {
        match viewer {
            Viewer::Organiser => Self::Organiser,
            Viewer::Team(team) => Self::Team(team),
            Viewer::Visitor => Self::Public,
        }
    }
}

impl FromRequestParts<App> for Viewer {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let OptionalCaller(caller) = OptionalCaller::from_request_parts(parts, app).await?;
        Ok(caller.as_ref().map_or(Self::Visitor, Self::new))
    }
}

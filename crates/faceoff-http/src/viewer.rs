//! Who looks at what everybody may look at: nobody needs a token, and the organiser's shows more.

use crate::{app::App, auth::Caller, problem::Problem};
use axum::{
    extract::FromRequestParts,
    http::{header, request::Parts},
};
use faceoff_types::TeamId;

/// A caller, with or without a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Viewer {
    Organiser,
    Team(TeamId),
    Anybody,
}

impl Viewer {
    pub(crate) fn of(caller: &Caller) -> Self {
        match caller {
            Caller::Organiser => Self::Organiser,
            Caller::Team(team) => Self::Team(team.id),
        }
    }
}

impl FromRequestParts<App> for Viewer {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        // Another scheme is somebody else's business: a proxy's in front of the pages.
        let has_token = parts
            .headers
            .get(header::AUTHORIZATION)
            .and_then(|value| value.as_bytes().get(..7))
            .is_some_and(|scheme| scheme.eq_ignore_ascii_case(b"bearer "));
        if !has_token {
            return Ok(Self::Anybody);
        }
        let caller = Caller::from_request_parts(parts, app).await?;
        Ok(Self::of(&caller))
    }
}

//! Who is calling: extractors that turn the bearer token into a team or the organiser.

use crate::{
    app::App,
    problem::{Problem, ProblemKind},
    token::{hash_token, same_hash},
};
use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, header, request::Parts},
};
use faceoff_store::{StoreError, Team};
use faceoff_types::TeamId;

/// A caller with a valid token.
#[derive(Debug, Clone)]
pub(crate) enum Caller {
    Organiser,
    Team(Team),
}

impl Caller {
    /// What was `found`, if it is of the caller's `team`; another team's looks like none at all.
    pub(crate) fn visible<T>(
        &self,
        what: &str,
        found: Result<T, StoreError>,
        team: impl Fn(&T) -> TeamId,
    ) -> Result<T, Problem> {
        let may_see = |found: &T| match self {
            Self::Organiser => true,
            Self::Team(own) => own.id == team(found),
        };
        match found {
            Ok(found) if may_see(&found) => Ok(found),
            Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found(what)),
            Err(error) => Err(error.into()),
        }
    }
}

/// Proof that the caller is the organiser.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Organiser;

/// What the organiser sees of what everybody may ask for: the proof, or why there is none.
#[derive(Debug)]
pub(crate) struct PerhapsOrganiser(Result<Organiser, Problem>);

impl PerhapsOrganiser {
    /// Refuses anybody else, where it has to be the organiser.
    pub(crate) fn check_if(self, must_be: bool) -> Result<(), Problem> {
        if must_be { self.0.map(drop) } else { Ok(()) }
    }
}

/// Proof that the caller is this team.
#[derive(Debug, Clone)]
pub(crate) struct TeamCaller(pub(crate) Team);

fn bearer(headers: &HeaderMap) -> Result<&str, Problem> {
    let problem = |detail: &str| Err(Problem::new(ProblemKind::Unauthenticated, detail));
    let Some(value) = headers.get(header::AUTHORIZATION) else {
        return problem(
            "no token came; send the header “Authorization: Bearer TOKEN” with your team's token, \
             or the organiser's",
        );
    };
    match value.to_str().ok().and_then(|value| value.split_once(' ')) {
        Some((scheme, token))
            if scheme.eq_ignore_ascii_case("bearer") && !token.trim().is_empty() =>
        {
            Ok(token.trim())
        }
        _ => problem("the header Authorization is not of the form “Bearer TOKEN”"),
    }
}

impl FromRequestParts<App> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let hash = hash_token(bearer(&parts.headers)?);
        if same_hash(&hash, &app.config.admin_token_hash) {
            return Ok(Self::Organiser);
        }
        // A look-up by hash is safe although its time may depend on the hash: nobody can choose a
        // token whose hash begins as another's does.
        match app.store.team_by_token_hash(hash).await? {
            Some(team) => Ok(Self::Team(team)),
            None => Err(Problem::new(
                ProblemKind::Unauthenticated,
                "the token is not known; it may have been replaced. Ask the organiser for a new one",
            )),
        }
    }
}

impl FromRequestParts<App> for Organiser {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        match Caller::from_request_parts(parts, app).await? {
            Caller::Organiser => Ok(Self),
            Caller::Team(team) => Err(Problem::new(
                ProblemKind::Forbidden,
                format!(
                    "this request needs the organiser's token; yours is that of the team “{}”",
                    team.name
                ),
            )),
        }
    }
}

impl FromRequestParts<App> for PerhapsOrganiser {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        Ok(Self(Organiser::from_request_parts(parts, app).await))
    }
}

impl FromRequestParts<App> for TeamCaller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        match Caller::from_request_parts(parts, app).await? {
            Caller::Team(team) => Ok(Self(team)),
            Caller::Organiser => Err(Problem::new(
                ProblemKind::Forbidden,
                "this request needs a team's token; yours is the organiser's. Use the token that \
                 POST /api/v1/teams returned",
            )),
        }
    }
}

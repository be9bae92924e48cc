//! Whoever looks at a desk: somebody who has signed in, or is led to where one does, and back.

use super::frame::PageProblem;
use crate::query::asking;
use axum::{
    extract::FromRequestParts,
    http::request::Parts,
    response::{IntoResponse, Redirect, Response},
};
use faceoff_service::{
    app::App,
    auth::{Anybody, Caller, Organiser, TeamCaller},
    problem::{Problem, ProblemKind},
};

/// Somebody who has signed in.
pub(super) struct SignedIn(pub(super) Caller);

/// A member of a team.
pub(super) struct Member {
    pub(super) caller: Caller,
    pub(super) team: TeamCaller,
}

/// Somebody who may organise.
pub(super) struct Organising {
    pub(super) caller: Caller,
    pub(super) organiser: Organiser,
}

/// Why somebody does not get to a desk.
pub(super) enum Refused {
    /// First they sign in; then they are led to this path.
    SignIn(String),
    Problem(Problem),
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        match self {
            Self::SignIn(next) => {
                Redirect::to(&asking("/sign-in", &[("next", next)])).into_response()
            }
            Self::Problem(problem) => PageProblem::from(problem).into_response(),
        }
    }
}

/// The places that one is led back to.
const PLACES: [&str; 4] = ["/desk", "/organiser", "/account", "/log"];

/// Those that the choice not to see results leads back to.
pub(super) const SPOILED: [&str; 2] = ["/tournaments", "/games"];

/// A path of this server's own, and nothing else: where somebody is led to is not a stranger's choice.
pub(super) fn own_place(path: &str) -> Option<&str> {
    own_place_of(&PLACES, path)
}

/// Likewise, below one of some places.
pub(super) fn own_place_of<'a>(places: &[&str], path: &'a str) -> Option<&'a str> {
    let is_plain = path.bytes().all(|byte| byte.is_ascii_graphic()) && !path.contains('\\');
    let is_place = places.iter().any(|place| {
        let rest = path.strip_prefix(place);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '?']))
    });
    (is_plain && is_place).then_some(path)
}

/// Where somebody wanted to be: of what is sent, the desk that it came from.
fn wanted(parts: &Parts) -> String {
    let path = parts.uri.path();
    if parts.method.is_safe() {
        let whole = parts.uri.path_and_query();
        return whole.map_or(path, |whole| whole.as_str()).to_owned();
    }
    let desk = PLACES.iter().find(|place| path.starts_with(**place));
    desk.map_or("/desk", |desk| *desk).to_owned()
}

impl FromRequestParts<App> for SignedIn {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Refused> {
        let caller = Anybody::from_request_parts(parts, app).await;
        let Anybody(caller) = caller.map_err(Refused::Problem)?;
        let caller = caller.ok_or_else(|| Refused::SignIn(wanted(parts)))?;
        Ok(Self(caller))
    }
}

impl FromRequestParts<App> for Member {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Refused> {
        let SignedIn(caller) = SignedIn::from_request_parts(parts, app).await?;
        match TeamCaller::of(caller.clone()) {
            Ok(team) => Ok(Self { caller, team }),
            Err(_) => Err(Refused::Problem(Problem::new(
                ProblemKind::Forbidden,
                "this page is for members of a team, and you have signed in as an organiser; the organiser's desk is at \
                 /organiser",
            ))),
        }
    }
}

impl FromRequestParts<App> for Organising {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Refused> {
        let SignedIn(caller) = SignedIn::from_request_parts(parts, app).await?;
        match Organiser::of(caller.clone()) {
            Ok(organiser) => Ok(Self { caller, organiser }),
            Err(_) => Err(Refused::Problem(Problem::new(
                ProblemKind::Forbidden,
                "this page is for organisers; your team's desk is at /desk",
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_is_led_away_from_this_server() {
        for own in [
            "/desk",
            "/desk/access",
            "/organiser/day?stage=1&day=2026-03-01",
        ] {
            assert_eq!(own_place(own), Some(own));
        }
        for foreign in [
            "",
            "/",
            "//evil.example",
            "/desk.evil.example",
            "https://evil.example/desk",
            "/desk/\\evil",
            "/desk\r\nSet-Cookie: a=b",
            "/organiserx",
        ] {
            assert_eq!(own_place(foreign), None, "{foreign:?}");
        }
    }
}

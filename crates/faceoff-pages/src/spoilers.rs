//! Who does not want to know yet how games ended: a choice that pages about games remember in a cookie, for whoever looks,
//! signed in or not. `/spoilers` takes it.

use super::{
    frame::PageProblem,
    signed_in::{SPOILED, own_place_of},
};
use axum::{
    extract::{FromRequestParts, Query, State},
    http::{HeaderValue, header, request::Parts},
    response::{AppendHeaders, IntoResponse, Redirect, Response},
};
use faceoff_service::{app::App, extract::PageForm, problem::Problem, session};
use faceoff_types::RoundNumber;
use serde::Deserialize;
use std::convert::Infallible;

/// Where the choice is sent.
pub const SPOILERS_PATH: &str = "/spoilers";
const NAME: &str = "spoilers";
const HIDDEN: &str = "hidden";
const AGE_S: u32 = 365 * 24 * 3600;
/// What asks for a game's result all the same.
const RESULT: &str = "result";
/// What asks who meets whom in a round that follows from results, with the round's number behind it.
const ROUND: &str = "round-";

/// What a page about games shows of their results.
#[derive(Debug, Clone, Default)]
pub(super) struct Spoilers {
    /// Has the visitor chosen not to see any?
    pub(super) are_hidden: bool,
    /// What is asked for all the same.
    show: Option<String>,
    /// The page without its query, which the choice leads back to.
    pub(super) path: String,
}

impl Spoilers {
    /// Is nothing told of how games ended?
    pub(super) fn hide(&self) -> bool {
        self.are_hidden && self.show.as_deref() != Some(RESULT)
    }

    /// May be told who plays in a round that was drawn from results?
    pub(super) fn tell_round(&self, round: RoundNumber) -> bool {
        let shown = self
            .show
            .as_deref()
            .and_then(|show| show.strip_prefix(ROUND));
        let shown: Option<u32> = shown.and_then(|number| number.parse().ok());
        !self.hide() || shown.is_some_and(|shown| round.get() <= shown)
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Asked {
    show: Option<String>,
}

impl FromRequestParts<App> for Spoilers {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Infallible> {
        let asked = Query::<Asked>::from_request_parts(parts, app).await;
        let Query(asked) = asked.unwrap_or_default();
        Ok(Self {
            are_hidden: session::named(&parts.headers, NAME) == Some(HIDDEN),
            show: asked.show,
            path: parts.uri.path().to_owned(),
        })
    }
}

/// What the switch sends.
#[derive(Deserialize)]
pub(super) struct Choice {
    results: Results,
    next: String,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Results {
    Hidden,
    Shown,
}

/// Remembers the choice, and leads back.
pub(super) async fn choose(
    State(app): State<App>,
    PageForm(Choice { results, next }): PageForm<Choice>,
) -> Result<Response, PageProblem> {
    let (value, age) = match results {
        Results::Hidden => (HIDDEN, AGE_S),
        Results::Shown => ("", 0),
    };
    let secure = session::secure(&app.config);
    let cookie = format!("{NAME}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={age}{secure}");
    let cookie = HeaderValue::try_from(cookie).map_err(Problem::internal)?;
    let next = own_place_of(&SPOILED, &next).unwrap_or("/tournaments");
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to(next)).into_response())
}

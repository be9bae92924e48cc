//! Spoilers are results of games that a visitor sees before watching the replay. Visitors choose to hide results with a form that posts
//! to `/spoilers`; a cookie stores the choice, so that it works without an account.

use super::{
    frame::PageProblem,
    game_row::ResultDisplay,
    page_auth::{SPOILER_RETURN_PATHS, return_path_below},
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

/// Path of the form.
pub const SPOILERS_PATH: &str = "/spoilers";
/// Name of the cookie.
const COOKIE: &str = "spoilers";
/// Value of the cookie that hides results.
const HIDDEN: &str = "hidden";
/// Lifetime of the cookie: a year, in seconds.
const MAX_AGE_S: u32 = 365 * 24 * 3600;
/// Query value that shows the result of a game all the same.
const SHOW_RESULT: &str = "result";
/// Query prefix that shows the pairings up to a round; the number of the round follows.
const SHOW_ROUND: &str = "round-";

/// Which results a page shows.
#[derive(Debug, Clone, Default)]
pub(super) struct Spoilers {
    /// Has the visitor chosen to hide results?
    pub(super) are_hidden: bool,
    /// The query parameter `show`.
    show: Option<String>,
    /// Path of the page, to return to after the choice.
    pub(super) path: String,
}

impl Spoilers {
    /// Are results hidden on this page? The query can show the result of a game although the visitor hides results.
    pub(super) fn hides_results(&self) -> bool {
        self.are_hidden && self.show.as_deref() != Some(SHOW_RESULT)
    }

    /// How lists of games on this page show results.
    pub(super) fn result_display(&self) -> ResultDisplay {
        match self.hides_results() {
            true => ResultDisplay::Hidden,
            false => ResultDisplay::Shown,
        }
    }

    /// Are the pairings of this round visible, although they depend on results?
    pub(super) fn shows_round(&self, round: RoundNumber) -> bool {
        let shown = self
            .show
            .as_deref()
            .and_then(|show| show.strip_prefix(SHOW_ROUND));
        let shown: Option<u32> = shown.and_then(|number| number.parse().ok());
        !self.hides_results() || shown.is_some_and(|shown| round.get() <= shown)
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct ShowQuery {
    show: Option<String>,
}

impl FromRequestParts<App> for Spoilers {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Infallible> {
        let query = Query::<ShowQuery>::from_request_parts(parts, app).await;
        let Query(query) = query.unwrap_or_default();
        Ok(Self {
            are_hidden: session::cookie_value(&parts.headers, COOKIE) == Some(HIDDEN),
            show: query.show,
            path: parts.uri.path().to_owned(),
        })
    }
}

#[derive(Deserialize)]
pub(super) struct Choice {
    results: Results,
    /// Path to return to.
    next: String,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Results {
    Hidden,
    Shown,
}

/// Stores the choice in a cookie and redirects back.
pub(super) async fn choose(
    State(app): State<App>,
    PageForm(Choice { results, next }): PageForm<Choice>,
) -> Result<Response, PageProblem> {
    let (value, age) = match results {
        Results::Hidden => (HIDDEN, MAX_AGE_S),
        Results::Shown => ("", 0),
    };
    let secure = session::secure_attribute(&app.config);
    let cookie = format!("{COOKIE}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={age}{secure}");
    let cookie = HeaderValue::try_from(cookie).map_err(Problem::internal)?;
    let target = return_path_below(&SPOILER_RETURN_PATHS, &next).unwrap_or("/tournaments");
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to(target)).into_response())
}

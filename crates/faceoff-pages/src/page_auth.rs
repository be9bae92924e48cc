//! Extractors for pages that need a signed-in user. Visitors without a session are redirected to the sign-in page and back.

use super::frame::PageProblem;
use crate::query::with_query;
use axum::{
    extract::FromRequestParts,
    http::request::Parts,
    response::{IntoResponse, Redirect, Response},
};
use faceoff_service::{
    app::App,
    auth::{Caller, OptionalCaller, Organiser, TeamCaller},
    problem::{Problem, ProblemKind},
};

/// A signed-in user.
pub(super) struct PageUser(pub(super) Caller);

/// A signed-in member of a team.
pub(super) struct PageMember {
    pub(super) caller: Caller,
    pub(super) team: TeamCaller,
}

/// A signed-in organiser.
pub(super) struct PageOrganiser {
    pub(super) caller: Caller,
    pub(super) organiser: Organiser,
}

pub(super) enum AuthRejection {
    /// Redirect to the sign-in page, and after signing in back to this path.
    SignIn(String),
    Problem(Problem),
}

impl IntoResponse for AuthRejection {
    fn into_response(self) -> Response {
        match self {
            Self::SignIn(next) => redirect_to_sign_in_for(&next),
            Self::Problem(problem) => PageProblem::from(problem).into_response(),
        }
    }
}

/// Paths to which the sign-in page may redirect, with everything below them. `/desk` and `/log` are addresses of older versions.
const RETURN_PATHS: [&str; 5] = ["/dashboard", "/desk", "/organiser", "/account", "/log"];

/// Paths to which the form of `/spoilers` may redirect.
pub(super) const SPOILER_RETURN_PATHS: [&str; 2] = ["/tournaments", "/games"];

/// `path` if it is a safe target of a redirect: a known path of this server, never another site.
pub(super) fn return_path(path: &str) -> Option<&str> {
    return_path_below(&RETURN_PATHS, path)
}

/// `path` if it is at or below one of `allowed`.
pub(super) fn return_path_below<'a>(allowed: &[&str], path: &'a str) -> Option<&'a str> {
    // Other characters could make a browser read the path as the address of another site.
    let has_safe_chars = path.bytes().all(|byte| byte.is_ascii_graphic()) && !path.contains('\\');
    let is_allowed = allowed.iter().any(|prefix| {
        let rest = path.strip_prefix(prefix);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '?']))
    });
    (has_safe_chars && is_allowed).then_some(path)
}

/// `path` if it is at or below a dashboard. Forms that are sent there are kept when the session has expired.
pub(super) fn form_path(path: &str) -> Option<&str> {
    return_path_below(&["/dashboard", "/organiser"], path)
}

/// The start page of the dashboard that `path` is below. The path of a form is not always the path of a page.
pub(super) fn form_page(path: &str) -> &'static str {
    let dashboard = RETURN_PATHS
        .iter()
        .find(|prefix| path.starts_with(**prefix));
    dashboard.map_or("/dashboard", |path| *path)
}

/// Redirects to the sign-in page and back to `target`.
fn redirect_to_sign_in_for(target: &str) -> Response {
    Redirect::to(&with_query("/sign-in", &[("next", target)])).into_response()
}

/// Redirects the sender of a form, which was sent to `path`, to the sign-in page and back to the dashboard.
pub(super) fn redirect_to_sign_in(path: &str) -> Response {
    redirect_to_sign_in_for(form_page(path))
}

/// Target after signing in: the requested page; for a form, the dashboard it belongs to.
fn target_after_sign_in(parts: &Parts) -> String {
    let path = parts.uri.path();
    if parts.method.is_safe() {
        let path_and_query = parts.uri.path_and_query();
        return path_and_query
            .map_or(path, |path_and_query| path_and_query.as_str())
            .to_owned();
    }
    form_page(path).to_owned()
}

impl FromRequestParts<App> for PageUser {
    type Rejection = AuthRejection;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, AuthRejection> {
        let caller = OptionalCaller::from_request_parts(parts, app).await;
        let OptionalCaller(caller) = caller.map_err(AuthRejection::Problem)?;
        let caller = caller.ok_or_else(|| AuthRejection::SignIn(target_after_sign_in(parts)))?;
        Ok(Self(caller))
    }
}

impl FromRequestParts<App> for PageMember {
    type Rejection = AuthRejection;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, AuthRejection> {
        let PageUser(caller) = PageUser::from_request_parts(parts, app).await?;
        match TeamCaller::new(caller.clone()) {
            Ok(team) => Ok(Self { caller, team }),
            Err(_) => Err(AuthRejection::Problem(Problem::new(
                ProblemKind::Forbidden,
                "this page is for members of a team, and you are signed in as an organiser; the organiser dashboard is at \
                 /organiser",
            ))),
        }
    }
}

impl FromRequestParts<App> for PageOrganiser {
    type Rejection = AuthRejection;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, AuthRejection> {
        let PageUser(caller) = PageUser::from_request_parts(parts, app).await?;
        match Organiser::new(caller.clone()) {
            Ok(organiser) => Ok(Self { caller, organiser }),
            Err(_) => Err(AuthRejection::Problem(Problem::new(
                ProblemKind::Forbidden,
                "this page is for organisers; the dashboard of your team is at /dashboard",
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn return_paths_never_leave_this_server() {
        for own in [
            "/dashboard",
            "/dashboard/access",
            "/organiser/day?stage=1&day=2026-03-01",
        ] {
            assert_eq!(return_path(own), Some(own));
        }
        for foreign in [
            "",
            "/",
            "//evil.example",
            "/dashboard.evil.example",
            "https://evil.example/dashboard",
            "/dashboard/\\evil",
            "/dashboard\r\nSet-Cookie: a=b",
            "/organiserx",
        ] {
            assert_eq!(return_path(foreign), None, "{foreign:?}");
        }
    }
}

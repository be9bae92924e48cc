//! The signed-in user in the navigation of every page. Found once per request, by the cookie of the browser's session: pages for visitors,
//! who have no cookie, stay the same for all of them.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use faceoff_api::paths::API_BASE;
use faceoff_service::{app::App, auth, views::pending_decisions};

tokio::task_local! {
    /// The user whose request the current task handles. Every page shows it, error pages included, so it is not passed through all of
    /// their functions.
    static SIGNED_IN: SignedIn;
}

/// The signed-in user, as the navigation shows them.
#[derive(Debug, Clone)]
pub(super) struct SignedIn {
    pub(super) name: String,
    /// Path of the user's dashboard.
    pub(super) dashboard: &'static str,
    /// Number of pending decisions; zero for members of teams.
    pub(super) pending_decisions: usize,
}

impl SignedIn {
    /// The user of the current request; `None` for visitors.
    pub(super) fn current() -> Option<Self> {
        SIGNED_IN.try_with(Clone::clone).ok()
    }

    /// Is there a user, without the name?
    pub(super) fn is_current() -> bool {
        SIGNED_IN.try_with(|_| ()).is_ok()
    }
}

/// Paths whose responses have no navigation.
fn has_no_navigation(path: &str) -> bool {
    let is_below = |prefix: &str| {
        path.strip_prefix(prefix)
            .is_some_and(|rest| rest.starts_with('/'))
    };
    is_below(API_BASE) || is_below("/static")
}

/// Finds the signed-in user of a request for a page.
pub async fn identify_viewer(State(app): State<App>, request: Request, next: Next) -> Response {
    if has_no_navigation(request.uri().path()) {
        return next.run(request).await;
    }
    // If the database cannot be read, the page itself says so.
    let caller = auth::session_caller(&app, request.headers()).await;
    let Some(caller) = caller.ok().flatten() else {
        return next.run(request).await;
    };
    let Some(user) = caller.user() else {
        return next.run(request).await;
    };
    let signed_in = SignedIn {
        name: user.name.to_string(),
        dashboard: match caller.is_organiser() {
            true => "/organiser",
            false => "/dashboard",
        },
        pending_decisions: match caller.is_organiser() {
            true => pending_decisions::count(&app).await.unwrap_or_default(),
            false => 0,
        },
    };
    SIGNED_IN.scope(signed_in, next.run(request)).await
}

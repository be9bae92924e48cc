//! The signed-in user in the navigation of every page. Found once per request, by the cookie of the browser's session: pages for visitors,
//! who have no cookie, stay the same for all of them.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use faceoff_api::paths::API_BASE;
use faceoff_service::{
    app::App,
    auth::{self, Caller, SessionCaller},
    views::pending_decisions,
};

tokio::task_local! {
    /// The user whose request the current task handles; not set for a visitor. Every page shows the user, error pages included,
    /// so it is not passed through all of their functions.
    static CURRENT_USER: CurrentUser;
}

/// The user who has sent a request for a page.
enum CurrentUser {
    Known(SignedIn),
    /// The request has a session, whose user could not be read from the database.
    Unknown,
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
        let user = CURRENT_USER.try_with(|current| match current {
            CurrentUser::Known(user) => Some(user.clone()),
            CurrentUser::Unknown => None,
        });
        user.ok().flatten()
    }

    /// `None` for a token of a team or of the operator, which belongs to no user.
    async fn new(app: &App, caller: &Caller) -> Option<Self> {
        let is_organiser = caller.is_organiser();
        Some(Self {
            name: caller.user()?.name.to_string(),
            dashboard: match is_organiser {
                true => "/organiser",
                false => "/dashboard",
            },
            pending_decisions: match is_organiser {
                true => pending_decisions::count(app).await.unwrap_or_default(),
                false => 0,
            },
        })
    }
}

/// Has a visitor sent the current request? False if that is not known.
pub(super) fn is_visitor() -> bool {
    CURRENT_USER.try_with(|_| ()).is_err()
}

/// Builds a response for a user who has just signed in, and who had sent the request as a visitor.
pub(super) async fn with_user<T>(
    app: &App,
    caller: Option<&Caller>,
    response: impl Future<Output = T>,
) -> T {
    let signed_in = match caller {
        Some(caller) => SignedIn::new(app, caller).await,
        None => None,
    };
    match signed_in {
        Some(user) => CURRENT_USER.scope(CurrentUser::Known(user), response).await,
        None => response.await,
    }
}

/// Paths whose responses have no navigation.
fn has_no_navigation(path: &str) -> bool {
    let is_below = |prefix: &str| {
        path.strip_prefix(prefix)
            .is_some_and(|rest| rest.starts_with('/'))
    };
    is_below(API_BASE) || is_below("/static") || path.ends_with(".svg")
}

/// A layer that finds the signed-in user of a request for a page. It passes the session on, so that the handler need not look it up again.
pub async fn identify_viewer(State(app): State<App>, mut request: Request, next: Next) -> Response {
    if has_no_navigation(request.uri().path()) {
        return next.run(request).await;
    }
    let caller = match auth::session_caller(&app, request.headers()).await {
        Ok(Some(caller)) => caller,
        Ok(None) => return next.run(request).await,
        // The handler meets the same error, and its page says what has failed.
        Err(_) => {
            return CURRENT_USER
                .scope(CurrentUser::Unknown, next.run(request))
                .await;
        }
    };
    let signed_in = SignedIn::new(&app, &caller).await;
    request.extensions_mut().insert(SessionCaller(caller));
    match signed_in {
        Some(user) => {
            CURRENT_USER
                .scope(CurrentUser::Known(user), next.run(request))
                .await
        }
        None => next.run(request).await,
    }
}

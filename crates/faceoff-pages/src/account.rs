//! `/account`: the signed-in user with their tokens and sessions.

use super::{
    figures::utc_minute,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{
    extract::State,
    response::{IntoResponse, Redirect, Response},
};
use faceoff_api::views::{
    token::TokenView,
    user::{CallerView, UserView},
};
use faceoff_service::{
    app::App,
    auth::OptionalCaller,
    problem::Problem,
    views::{season::SeasonHead, token, user as user_view},
};
use faceoff_store::TokenOwner;
use jiff::Timestamp;

#[derive(Template)]
#[template(path = "account.html")]
struct Page {
    frame: Frame,
    account: CallerView,
    user: UserView,
    tokens: Vec<TokenView>,
    now: Timestamp,
}

impl Page {
    fn timestamp(&self, instant: &Timestamp) -> String {
        utc_minute(*instant)
    }

    fn state(&self, token: &TokenView) -> String {
        match (token.revoked_at, token.expires_at) {
            (Some(revoked_at), _) => format!("revoked {}", self.timestamp(&revoked_at)),
            (None, Some(expires_at)) if expires_at <= self.now => {
                format!("expired {}", self.timestamp(&expires_at))
            }
            (None, Some(expires_at)) => format!("valid until {}", self.timestamp(&expires_at)),
            (None, None) => "valid".into(),
        }
    }
}

/// The account; redirects to the sign-in page without a session.
pub(super) async fn page(
    OptionalCaller(caller): OptionalCaller,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let Some((caller, user)) = caller.and_then(|caller| {
        let user = caller.user()?.clone();
        Some((caller, user))
    }) else {
        return Ok(Redirect::to("/sign-in").into_response());
    };
    let tokens = app.store.tokens().await.map_err(Problem::from)?;
    let own = tokens
        .into_iter()
        .filter(|token| token.owner == TokenOwner::User(user.id));
    let season = SeasonHead::load(&app).await?.name;
    render(&Page {
        frame: Frame::for_app(&app, season, "/account"),
        tokens: own.map(token::view).collect(),
        account: user_view::caller(caller.principal, token::view(caller.token)),
        user: user_view::view(user),
        now: app.config.clock.now(),
    })
}

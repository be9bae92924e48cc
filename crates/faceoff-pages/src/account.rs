//! `/account`: the signed-in user with their tokens and sessions.

use super::{
    format::expiry_state,
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
    views::{token, user as user_view},
};
use faceoff_store::TokenFilter;
use jiff::Timestamp;

/// How many of the newest tokens and sessions are searched for expired and revoked ones. All valid ones are listed.
const MAX_LISTED: u32 = 100;

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
    fn state(&self, token: &TokenView) -> String {
        let state = expiry_state(token.revoked_at, token.expires_at, self.now);
        state.unwrap_or_else(|| "valid".to_owned())
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
        return Ok(Redirect::to("/sign-in?next=%2Faccount").into_response());
    };
    let (own, now) = (TokenFilter::User(user.id), app.config.clock.now());
    let mut tokens = app.store.valid_tokens(own, now).await?;
    let newest = app.store.tokens_after(own, None, MAX_LISTED).await?;
    let newest = newest.into_iter().flatten();
    tokens.extend(newest.filter(|token| !token.is_valid(now)));
    render(&Page {
        frame: Frame::load(&app, "/account").await?,
        tokens: tokens.into_iter().map(token::view).collect(),
        account: user_view::caller(caller.principal, token::view(caller.token)),
        user: user_view::view(user),
        now,
    })
}

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
    views::{season::SeasonHead, token, user},
};
use faceoff_store::TokenOwner;
use jiff::Timestamp;

#[derive(Template)]
#[template(path = "account.html")]
struct Page {
    frame: Frame,
    account: CallerView,
    person: UserView,
    tokens: Vec<TokenView>,
    now: Timestamp,
}

impl Page {
    fn timestamp(&self, at: &Timestamp) -> String {
        utc_minute(*at)
    }

    fn state(&self, token: &TokenView) -> String {
        match (token.revoked_at, token.expires_at) {
            (Some(at), _) => format!("revoked {}", self.timestamp(&at)),
            (None, Some(at)) if at <= self.now => format!("expired {}", self.timestamp(&at)),
            (None, Some(at)) => format!("valid until {}", self.timestamp(&at)),
            (None, None) => "valid".into(),
        }
    }
}

/// The account; redirects to the sign-in page without a session.
pub(super) async fn page(
    OptionalCaller(caller): OptionalCaller,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let Some((caller, person)) = caller.and_then(|caller| {
        let person = caller.user()?.clone();
        Some((caller, person))
    }) else {
        return Ok(Redirect::to("/sign-in").into_response());
    };
    let tokens = app.store.tokens().await.map_err(Problem::from)?;
    let own = tokens
        .into_iter()
        .filter(|token| token.owner == TokenOwner::User(person.id));
    let season = SeasonHead::load(&app).await?.name;
    render(&Page {
        frame: Frame::for_app(&app, season, "/account"),
        tokens: own.map(token::view).collect(),
        account: user::caller(caller.principal, token::view(caller.token)),
        person: user::view(person),
        now: app.config.clock.now(),
    })
}

//! `/account`: who has signed in, and the tokens and sessions that are theirs.

use super::{
    figures::minute,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{
    extract::State,
    response::{IntoResponse, Redirect, Response},
};
use faceoff_api::views::{
    person::{PersonView, WhoView},
    token::TokenView,
};
use faceoff_service::{
    app::App,
    auth::Anybody,
    problem::Problem,
    views::{person, season::SeasonHead, token},
};
use faceoff_store::TokenOwner;
use jiff::Timestamp;

#[derive(Template)]
#[template(path = "account.html")]
struct Page {
    frame: Frame,
    who: WhoView,
    person: PersonView,
    tokens: Vec<TokenView>,
    now: Timestamp,
}

impl Page {
    fn shown(&self, at: &Timestamp) -> String {
        minute(*at)
    }

    fn state(&self, token: &TokenView) -> String {
        match (token.revoked_at, token.expires_at) {
            (Some(at), _) => format!("revoked {}", self.shown(&at)),
            (None, Some(at)) if at <= self.now => format!("expired {}", self.shown(&at)),
            (None, Some(at)) => format!("good until {}", self.shown(&at)),
            (None, None) => "good".into(),
        }
    }
}

/// The account, or where one signs in.
pub(super) async fn page(
    Anybody(caller): Anybody,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let Some((caller, person)) = caller.and_then(|caller| {
        let person = caller.person()?.clone();
        Some((caller, person))
    }) else {
        return Ok(Redirect::to("/sign-in").into_response());
    };
    let tokens = app.store.tokens().await.map_err(Problem::from)?;
    let own = tokens
        .into_iter()
        .filter(|token| token.owner == TokenOwner::Person(person.id));
    let season = SeasonHead::now(&app).await?.name;
    render(&Page {
        frame: Frame::of(&app, season, "/account"),
        tokens: own.map(token::of).collect(),
        who: person::who(caller.who, token::of(caller.token)),
        person: person::of(person),
        now: app.config.clock.now(),
    })
}

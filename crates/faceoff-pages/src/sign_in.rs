//! `/sign-in` and `/sign-out`: a session by name and password.

use super::{
    frame::{Frame, PageProblem, render},
    signed_in::own_place,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    http::header,
    response::{AppendHeaders, IntoResponse, Redirect, Response},
};
use faceoff_service::{
    acts::signing_in::sign_in, app::App, auth::Caller, extract::PageForm, problem::ProblemKind,
    session, views::season::SeasonHead,
};
use serde::Deserialize;

/// Where one is led who wanted to be nowhere else.
const ACCOUNT: &str = "/account";

#[derive(Template)]
#[template(path = "sign_in.html")]
struct Page {
    frame: Frame,
    name: String,
    refused: Option<String>,
    /// Where one wanted to be; empty: nowhere.
    next: String,
}

#[derive(Deserialize)]
pub(super) struct Form {
    name: String,
    password: String,
    #[serde(default)]
    next: String,
}

/// Where one is led afterwards.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Wanted {
    next: String,
}

fn own(next: &str) -> String {
    own_place(next).unwrap_or_default().to_owned()
}

async fn page_with(
    app: &App,
    name: String,
    refused: Option<String>,
    next: String,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    render(&Page {
        frame: Frame::of(app, season, "/sign-in"),
        name,
        refused,
        next,
    })
}

pub(super) async fn page(
    State(app): State<App>,
    Query(Wanted { next }): Query<Wanted>,
) -> Result<Response, PageProblem> {
    page_with(&app, String::new(), None, own(&next)).await
}

/// Signs in and leads to where one wanted to be, or to the account, or says on the same page why not.
pub(super) async fn submit(
    State(app): State<App>,
    PageForm(form): PageForm<Form>,
) -> Result<Response, PageProblem> {
    match sign_in(&app, &form.name, form.password).await {
        Ok((_, secret)) => {
            let next = own_place(&form.next).unwrap_or(ACCOUNT);
            led_to(&app, secret.as_str(), next)
        }
        Err(problem)
            if matches!(
                problem.kind(),
                ProblemKind::Unauthenticated | ProblemKind::TooManySignIns
            ) =>
        {
            let status = problem.kind().status();
            let refused = Some(problem.detail().to_owned());
            let next = own(&form.next);
            let page = page_with(&app, form.name, refused, next).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem.into()),
    }
}

/// To the account, with the cookie of a session that has begun.
pub(super) fn signed_in(app: &App, secret: &str) -> Result<Response, PageProblem> {
    led_to(app, secret, ACCOUNT)
}

fn led_to(app: &App, secret: &str, path: &str) -> Result<Response, PageProblem> {
    let cookie = session::set_cookie(&app.config, Some(secret))?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to(path)).into_response())
}

/// Ends the session and leads to the board.
pub(super) async fn sign_out(
    caller: Caller,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let actor = caller.actor();
    let ended = app.store.revoke_token(actor, caller.token.id, now).await;
    ended.map_err(faceoff_service::problem::Problem::from)?;
    let cookie = session::set_cookie(&app.config, None)?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to("/")).into_response())
}

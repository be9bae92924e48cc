//! `/sign-in` and `/sign-out`: a session by name and password.

use super::frame::{Frame, PageProblem, render};
use crate::{
    acts::signing_in::sign_in, app::App, auth::Caller, extract::PageForm, problem::ProblemKind,
    session, views::season::SeasonHead,
};
use askama::Template;
use axum::{
    extract::State,
    http::header,
    response::{AppendHeaders, IntoResponse, Redirect, Response},
};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "sign_in.html")]
struct Page {
    frame: Frame,
    name: String,
    refused: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct Form {
    name: String,
    password: String,
}

async fn page_with(
    app: &App,
    name: String,
    refused: Option<String>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    render(&Page {
        frame: Frame::of(app, season, "/sign-in"),
        name,
        refused,
    })
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    page_with(&app, String::new(), None).await
}

/// Signs in and leads to the account, or says on the same page why not.
pub(super) async fn submit(
    State(app): State<App>,
    PageForm(form): PageForm<Form>,
) -> Result<Response, PageProblem> {
    match sign_in(&app, &form.name, form.password).await {
        Ok((_, secret)) => signed_in(&app, secret.as_str()),
        Err(problem)
            if matches!(
                problem.kind(),
                ProblemKind::Unauthenticated | ProblemKind::TooManySignIns
            ) =>
        {
            let status = problem.kind().status();
            let refused = Some(problem.detail().to_owned());
            let page = page_with(&app, form.name, refused).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem.into()),
    }
}

/// To the account, with the cookie of a session that has begun.
pub(super) fn signed_in(app: &App, secret: &str) -> Result<Response, PageProblem> {
    let cookie = session::set_cookie(&app.config, Some(secret))?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to("/account")).into_response())
}

/// Ends the session and leads to the board.
pub(super) async fn sign_out(
    caller: Caller,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let actor = caller.actor();
    let ended = app.store.revoke_token(actor, caller.token.id, now).await;
    ended.map_err(crate::problem::Problem::from)?;
    let cookie = session::set_cookie(&app.config, None)?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to("/")).into_response())
}

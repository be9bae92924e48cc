//! Signing in and out, for browsers.

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{requests::SignIn, views::person::PersonView};
use faceoff_service::{
    acts::signing_in::sign_in, app::App, auth::Caller, extract::Json as Body, problem::Problem,
    session, views::person,
};

/// Signs in by name and password: the answer sets the cookie of a session, for pages of this server.
#[utoipa::path(
    post, path = "/sessions", tag = "people", request_body = SignIn,
    responses(
        (status = 201, body = PersonView),
        (status = 401, description = "name and password do not belong together"),
        (status = 403, description = "it comes from a foreign page"),
        (status = 429, description = "too many wrong passwords"),
    )
)]
pub(crate) async fn create_session(
    State(app): State<App>,
    headers: HeaderMap,
    Body(SignIn { name, password }): Body<SignIn>,
) -> Result<impl IntoResponse, Problem> {
    // A foreign page must not sign its visitors in as somebody else.
    if headers.contains_key(header::ORIGIN) || headers.contains_key("sec-fetch-site") {
        session::check_own_page(&headers)?;
    }
    let (id, secret) = sign_in(&app, &name, password).await?;
    let person = app.store.person(id).await?;
    let cookie = session::set_cookie(&app.config, Some(secret.as_str()))?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((StatusCode::CREATED, cookie, Json(person::of(person))))
}

/// Ends the session whose cookie came, or revokes the token that did.
#[utoipa::path(
    delete, path = "/sessions/current", tag = "people", security(("team" = []), ("organiser" = [])),
    responses((status = 204))
)]
pub(crate) async fn end_session(
    caller: Caller,
    State(app): State<App>,
) -> Result<impl IntoResponse, Problem> {
    let now = app.config.clock.now();
    let actor = caller.actor();
    app.store.revoke_token(actor, caller.token.id, now).await?;
    let cookie = session::set_cookie(&app.config, None)?;
    Ok((
        StatusCode::NO_CONTENT,
        AppendHeaders([(header::SET_COOKIE, cookie)]),
    ))
}

//! Sessions of browsers: signing in and out.

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{requests::SignInRequest, views::user::UserView};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::Json as Body,
    network::ClientNetwork,
    problem::Problem,
    services::sessions::{self, sign_in},
    session,
    views::user,
};

/// Signs in with name and password. The response sets the session cookie for pages of this server.
#[utoipa::path(
    post, path = "/sessions", tag = "people", request_body = SignInRequest,
    responses(
        (status = 201, body = UserView),
        (status = 401, description = "wrong name or password"),
        (status = 403, description = "the request comes from a page of another site"),
        (status = 429, description = "too many wrong passwords"),
        (status = 503, description = "too many sign-ins at the moment, in all or from this address"),
    )
)]
pub(crate) async fn create_session(
    State(app): State<App>,
    ClientNetwork(client): ClientNetwork,
    headers: HeaderMap,
    Body(SignInRequest { name, password }): Body<SignInRequest>,
) -> Result<impl IntoResponse, Problem> {
    // A page of another site must not sign its visitors in under another account.
    if headers.contains_key(header::ORIGIN) || headers.contains_key("sec-fetch-site") {
        session::check_same_origin(&headers)?;
    }
    let (id, secret) = sign_in(&app, &name, password, client).await?;
    let user = app.store.user(id).await?;
    let cookie = session::set_cookie(&app.config, Some(secret.as_str()))?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((StatusCode::CREATED, cookie, Json(user::view(user))))
}

/// Ends the session, or revokes the token, of this request.
#[utoipa::path(
    delete, path = "/sessions/current", tag = "people", security(("team" = []), ("organiser" = [])),
    responses((status = 204))
)]
pub(crate) async fn end_session(
    caller: Caller,
    State(app): State<App>,
) -> Result<impl IntoResponse, Problem> {
    sessions::end(&app, &caller).await?;
    let cookie = session::set_cookie(&app.config, None)?;
    Ok((
        StatusCode::NO_CONTENT,
        AppendHeaders([(header::SET_COOKIE, cookie)]),
    ))
}

//! Keys to the API: named, expiring, rotated and revoked at once.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests,
    views::{
        person::WhoView,
        token::{NewTokenView, TokenView},
    },
};
use faceoff_service::{
    acts::keys,
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::{person, token},
};
use faceoff_types::TokenId;

/// Who the caller is: their role, their team, and the token with which they call.
#[utoipa::path(
    get, path = "/whoami", tag = "people", security(("team" = []), ("organiser" = [])),
    responses((status = 200, body = WhoView), (status = 401))
)]
pub(crate) async fn whoami(caller: Caller) -> Json<WhoView> {
    Json(person::who(caller.who, token::of(caller.token)))
}

/// The tokens and sessions that the caller may manage, the newest first: an organiser's are all of them.
#[utoipa::path(
    get, path = "/tokens", tag = "people", security(("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<TokenView>))
)]
pub(crate) async fn list_tokens(
    caller: Caller,
    page: Page<TokenId>,
    State(app): State<App>,
) -> Result<Paged<TokenView>, Problem> {
    let page = page.cut(keys::tokens(&app, &caller).await?, |token| token.id)?;
    Ok(page.map(token::of))
}

/// Makes a token and returns it, once.
#[utoipa::path(
    post, path = "/tokens", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewToken,
    responses(
        (status = 201, body = NewTokenView),
        (status = 403, description = "a team's own token makes no others"),
        (status = 404, description = "no such team"),
        (status = 409, description = "there are as many as there may be, or it would be worth nothing"),
        (status = 422),
    )
)]
pub(crate) async fn create_token(
    caller: Caller,
    State(app): State<App>,
    Body(new): Body<requests::NewToken>,
) -> Result<(StatusCode, Json<NewTokenView>), Problem> {
    let view = keys::create_token(&app, &caller, new).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Gives a token another secret and returns it, once; from then on the old one is worth nothing.
#[utoipa::path(
    post, path = "/tokens/{id}/rotate", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TokenId, Path)),
    responses(
        (status = 200, body = NewTokenView),
        (status = 404),
        (status = 409, description = "it is a session, revoked, has expired, or is the host's of the data folder"),
    )
)]
pub(crate) async fn rotate_token(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TokenId>,
) -> Result<Json<NewTokenView>, Problem> {
    keys::rotate_token(&app, &caller, id).await.map(Json)
}

/// Revokes a token, or ends a session: from then on it is worth nothing.
#[utoipa::path(
    delete, path = "/tokens/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TokenId, Path)),
    responses((status = 200, body = TokenView), (status = 404))
)]
pub(crate) async fn revoke_token(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TokenId>,
) -> Result<Json<TokenView>, Problem> {
    keys::revoke_token(&app, &caller, id).await.map(Json)
}

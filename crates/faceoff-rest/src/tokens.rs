//! API tokens, and the sessions of browsers, which are tokens in a cookie.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests,
    views::{
        credentials::RevokedTokenView,
        token::{NewTokenView, TokenView},
        user::CallerView,
    },
};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam, QueryParams},
    problem::Problem,
    services::tokens,
    views::{token, user},
};
use faceoff_types::TokenId;

/// Returns the caller: role, team, and the token of this request.
#[utoipa::path(
    get, path = "/whoami", tag = "people", security(("team" = []), ("organiser" = [])),
    responses((status = 200, body = CallerView), (status = 401))
)]
pub(crate) async fn whoami(caller: Caller) -> Json<CallerView> {
    Json(user::caller(caller.principal, token::view(caller.token)))
}

/// Lists the tokens and sessions that the caller may manage, newest first; organisers see all.
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
    let rows = tokens::tokens_after(&app, &caller, page.after, page.limit + 1).await?;
    let rows = rows.ok_or_else(|| page.unknown_row())?;
    Ok(page.page(rows, |token| token.id).map(token::view))
}

/// Creates a token. Its secret is returned only once.
#[utoipa::path(
    post, path = "/tokens", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewToken,
    responses(
        (status = 201, body = NewTokenView),
        (status = 403, description = "a team's token cannot create tokens"),
        (status = 404, description = "no such team"),
        (status = 409, description = "the owner has as many tokens as allowed, or the token would already be expired"),
        (status = 422),
    )
)]
pub(crate) async fn create_token(
    caller: Caller,
    State(app): State<App>,
    Body(request): Body<requests::NewToken>,
) -> Result<(StatusCode, Json<NewTokenView>), Problem> {
    let view = tokens::create_token(&app, &caller, request).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Replaces a token's secret; the new one is returned only once. The old secret becomes invalid.
#[utoipa::path(
    post, path = "/tokens/{id}/rotate", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TokenId, Path)),
    responses(
        (status = 200, body = NewTokenView),
        (status = 403, description = "another user's token, or one of the operator"), (status = 404),
        (status = 409, description = "it is a session, is revoked or expired, or is the operator's token in the data folder"),
    )
)]
pub(crate) async fn rotate_token(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TokenId>,
) -> Result<Json<NewTokenView>, Problem> {
    tokens::rotate_token(&app, &caller, id).await.map(Json)
}

/// Revokes a token, or ends a session. Unless it is your own, the tokens, invitations and webhooks that were created with it
/// end, too. The query parameter `made` overrides this: `keep` keeps them, `end` ends them.
#[utoipa::path(
    delete, path = "/tokens/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TokenId, Path), requests::RevocationQuery),
    responses((status = 200, body = RevokedTokenView), (status = 404))
)]
pub(crate) async fn revoke_token(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TokenId>,
    QueryParams(query): QueryParams<requests::RevocationQuery>,
) -> Result<Json<RevokedTokenView>, Problem> {
    let revoked = tokens::revoke_token(&app, &caller, id, query.made);
    revoked.await.map(Json)
}

//! Users: listing and renaming them, setting passwords, and closing accounts.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Confirmation, NewPassword, UserChange},
    views::{credentials::ChangedAccessView, user::UserView},
};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    network::ClientNetwork,
    problem::Problem,
    services::users,
    views::{credentials, user},
};
use faceoff_store::{EndedCredentials, User};
use faceoff_types::UserId;

/// Lists the users whom the caller may see: organisers all, a team its members.
#[utoipa::path(
    get, path = "/people", tag = "people", security(("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<UserView>))
)]
pub(crate) async fn list_people(
    caller: Caller,
    page: Page<UserId>,
    State(app): State<App>,
) -> Result<Paged<UserView>, Problem> {
    let users = users::list_users(&app, &caller).await?;
    let page = page.select(users, |user| user.id)?;
    Ok(page.map(user::view))
}

/// Changes a user's name, with which the user signs in. Tokens and sessions stay valid. For organisers and the user.
#[utoipa::path(
    patch, path = "/people/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = UserId, Path)), request_body = UserChange,
    responses(
        (status = 200, body = UserView),
        (status = 403), (status = 404),
        (status = 409, description = "another user, perhaps a former one, has the name or one that looks like it, or the account is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_person(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<UserId>,
    Body(UserChange { name }): Body<UserChange>,
) -> Result<Json<UserView>, Problem> {
    let renamed = users::rename_user(&app, &caller, id, name).await?;
    Ok(Json(user::view(renamed)))
}

/// Closes a user's account at once: all tokens and sessions are revoked, and the team tokens, invitations and webhooks that the user has
/// made end. For organisers and the user.
#[utoipa::path(
    post, path = "/people/{id}/remove", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = UserId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = ChangedAccessView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the user's name (nothing is done), the account is closed, or it is the last organiser's"),
    )
)]
pub(crate) async fn remove_person(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<UserId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<ChangedAccessView>, Problem> {
    let removed = users::remove_user(&app, &caller, id, confirm.as_deref()).await?;
    Ok(changed_access(removed, &app))
}

fn changed_access((user, ended): (User, EndedCredentials), app: &App) -> Json<ChangedAccessView> {
    Json(ChangedAccessView {
        user: user::view(user),
        ended: credentials::ended(ended, app.config.clock.now()),
    })
}

/// Sets the caller's password. All other tokens and sessions of the user are revoked, and the team tokens, invitations and webhooks that
/// the user has made end.
#[utoipa::path(
    put, path = "/people/{id}/password", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = UserId, Path)), request_body = NewPassword,
    responses(
        (status = 200, body = ChangedAccessView),
        (status = 403, description = "another user's password, or the old password is wrong"),
        (status = 404), (status = 422), (status = 429, description = "too many wrong passwords"),
    )
)]
pub(crate) async fn set_password(
    caller: Caller,
    State(app): State<App>,
    ClientNetwork(client): ClientNetwork,
    PathParam(id): PathParam<UserId>,
    Body(request): Body<NewPassword>,
) -> Result<Json<ChangedAccessView>, Problem> {
    let changed = users::set_password(&app, &caller, id, request, client).await?;
    Ok(changed_access(changed, &app))
}

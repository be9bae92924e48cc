//! Invitations, links with which a person becomes a user: creating, listing, revoking and accepting them.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{self, JoinRequest},
    views::{
        credentials::NewAccountView,
        invitation::{InvitationView, NewInvitationView},
    },
};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    network::ClientNetwork,
    problem::Problem,
    services::{accounts::join, invitations},
    views::{credentials, invitation, token, user},
};
use faceoff_store::{Principal, TokenKind};
use faceoff_types::InvitationId;

/// Creates an invitation; its link is returned only once. Organisers invite to any role, members to their team.
#[utoipa::path(
    post, path = "/invitations", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewInvitation,
    responses(
        (status = 201, body = NewInvitationView),
        (status = 403), (status = 404, description = "no such team or user"),
        (status = 409, description = "the team has too many open invitations, or the returning user's account is closed"),
        (status = 422),
    )
)]
pub(crate) async fn create_invitation(
    caller: Caller,
    State(app): State<App>,
    Body(request): Body<requests::NewInvitation>,
) -> Result<(StatusCode, Json<NewInvitationView>), Problem> {
    let view = invitations::create_invitation(&app, &caller, request).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Lists the invitations that the caller may manage, newest first; organisers see all.
#[utoipa::path(
    get, path = "/invitations", tag = "people", security(("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<InvitationView>))
)]
pub(crate) async fn list_invitations(
    caller: Caller,
    page: Page<InvitationId>,
    State(app): State<App>,
) -> Result<Paged<InvitationView>, Problem> {
    let now = app.config.clock.now();
    let rows = invitations::invitations_after(&app, &caller, page.after, page.limit + 1).await?;
    let rows = rows.ok_or_else(|| page.unknown_row())?;
    let page = page.page(rows, |invitation| invitation.id);
    Ok(page.map(|invitation| invitation::view(invitation, now)))
}

/// Revokes an invitation: its link is invalid from now on.
#[utoipa::path(
    delete, path = "/invitations/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = InvitationId, Path)),
    responses(
        (status = 200, body = InvitationView),
        (status = 404),
        (status = 409, description = "the invitation has been accepted"),
    )
)]
pub(crate) async fn revoke_invitation(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<InvitationId>,
) -> Result<Json<InvitationView>, Problem> {
    let revoked = invitations::revoke_invitation(&app, &caller, id);
    revoked.await.map(Json)
}

/// Accepts an invitation: creates a user with its role, or gives a returning user access again. Returns a token, which is shown only once.
#[utoipa::path(
    post, path = "/invitations/accept", tag = "people", request_body = JoinRequest,
    responses(
        (status = 201, body = NewAccountView),
        (status = 409, description = "the invitation is not or no longer valid, a name is taken, or a required field is missing"),
        (status = 422),
    )
)]
pub(crate) async fn accept_invitation(
    State(app): State<App>,
    ClientNetwork(client): ClientNetwork,
    Body(request): Body<JoinRequest>,
) -> Result<(StatusCode, Json<NewAccountView>), Problem> {
    let (joined, secret) = join(&app, request, TokenKind::ApiToken, None, client).await?;
    let principal = match joined.team {
        Some(team) => Principal::Member(joined.user, team),
        None => Principal::Organiser(joined.user),
    };
    let view = NewAccountView {
        caller: user::caller(principal, token::view(joined.token)),
        secret: secret.as_str().to_owned(),
        ended: credentials::ended(joined.ended, app.config.clock.now()),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

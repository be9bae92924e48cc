//! Links by which people join, and joining.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{self, Join},
    views::{
        invitation::{InvitationView, NewInvitationView},
        person::JoinedView,
    },
};
use faceoff_service::{
    acts::{inviting, joining::join},
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::{invitation, person, token},
};
use faceoff_store::{TokenKind, Who};
use faceoff_types::InvitationId;

/// Makes an invitation and returns its link, once. Organisers invite whomever they want, members into their team.
#[utoipa::path(
    post, path = "/invitations", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewInvitation,
    responses(
        (status = 201, body = NewInvitationView),
        (status = 403), (status = 404, description = "no such team or person"),
        (status = 409, description = "too many of the team are open, or who is to return has left"),
        (status = 422),
    )
)]
pub(crate) async fn create_invitation(
    caller: Caller,
    State(app): State<App>,
    Body(new): Body<requests::NewInvitation>,
) -> Result<(StatusCode, Json<NewInvitationView>), Problem> {
    let view = inviting::create_invitation(&app, &caller, new).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// The invitations that the caller may manage, the newest first: an organiser's are all of them.
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
    let invitations = inviting::invitations(&app, &caller).await?;
    let page = page.cut(invitations, |invitation| invitation.id)?;
    Ok(page.map(|invitation| invitation::of(invitation, now)))
}

/// Takes an invitation back: its link is worth nothing from then on.
#[utoipa::path(
    delete, path = "/invitations/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = InvitationId, Path)),
    responses(
        (status = 200, body = InvitationView),
        (status = 404),
        (status = 409, description = "somebody has followed it"),
    )
)]
pub(crate) async fn revoke_invitation(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<InvitationId>,
) -> Result<Json<InvitationView>, Problem> {
    let revoked = inviting::revoke_invitation(&app, &caller, id);
    revoked.await.map(Json)
}

/// Follows an invitation, once: the caller becomes a person with a role and gets a token, which is shown this once.
#[utoipa::path(
    post, path = "/invitations/accept", tag = "people", request_body = Join,
    responses(
        (status = 201, body = JoinedView),
        (status = 409, description = "the invitation is worth nothing (any more), a name is taken, or something is missing"),
        (status = 422),
    )
)]
pub(crate) async fn accept_invitation(
    State(app): State<App>,
    Body(body): Body<Join>,
) -> Result<(StatusCode, Json<JoinedView>), Problem> {
    let (joined, secret) = join(&app, body, TokenKind::Key, None).await?;
    let who = match joined.team {
        Some(team) => Who::Member(joined.person, team),
        None => Who::Organiser(joined.person),
    };
    let view = JoinedView {
        who: person::who(who, token::of(joined.token)),
        secret: secret.as_str().to_owned(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

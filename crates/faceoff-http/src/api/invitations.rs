//! Links by which people join, and joining.

use crate::{
    acts::joining::{good_until, join, link},
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    paging::{Page, PageQuery, Paged},
    problem::{Problem, ProblemKind},
    requests::{self, InvitedRole, Join},
    text,
    token::{Secret, SecretKind},
    views::{
        invitation::{InvitationView, NewInvitationView},
        person::{JoinedView, WhoView},
    },
};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_store::{Invitation, InvitedAs, NewInvitation, TokenKind, Who};
use faceoff_types::InvitationId;
use jiff::SignedDuration;

/// The longest time for which an invitation is good.
const LONGEST: SignedDuration = SignedDuration::from_hours(90 * 24);
const NOTE_CHARS: usize = 80;

fn may_manage(caller: &Caller, invitation: &Invitation) -> bool {
    match (&caller.who, invitation.invited_as) {
        (Who::Host | Who::Organiser(_), _) => true,
        (Who::Member(_, own), InvitedAs::Member(team)) => own.id == team,
        (Who::Member(..) | Who::Team(_), _) => false,
    }
}

/// What a caller invites to.
fn invited_as(caller: &Caller, new: &requests::NewInvitation) -> Result<InvitedAs, Problem> {
    let unless = |field: &str, is_given: bool| match is_given {
        true => Err(Problem::invalid(
            field,
            "it does not belong to this role; leave it out",
        )),
        false => Ok(()),
    };
    if new.role != InvitedRole::Member {
        unless("team", new.team.is_some())?;
    }
    if new.role != InvitedRole::Return {
        unless("person", new.person.is_some())?;
    }
    let forbidden = |detail: &str| Err(Problem::new(ProblemKind::Forbidden, detail));
    match (&caller.who, new.role) {
        (Who::Team(_), _) => {
            forbidden("a team's own token invites nobody; a member does, or an organiser")
        }
        (Who::Member(_, own), InvitedRole::Member) => match new.team {
            Some(team) if team != own.id => Err(Problem::not_found("team")),
            _ => Ok(InvitedAs::Member(own.id)),
        },
        (Who::Member(..), _) => forbidden("a member invites members of their team alone"),
        (_, InvitedRole::Organiser) => Ok(InvitedAs::Organiser),
        (_, InvitedRole::Founder) => Ok(InvitedAs::Founder),
        (_, InvitedRole::Member) => new.team.map(InvitedAs::Member).ok_or_else(|| {
            Problem::invalid(
                "team",
                "expected the id of the team whose member they become",
            )
        }),
        (_, InvitedRole::Return) => new
            .person
            .map(InvitedAs::Return)
            .ok_or_else(|| Problem::invalid("person", "expected the id of who is to return")),
    }
}

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
    let invited_as = invited_as(&caller, &new)?;
    let note = text::line("note", &new.note, NOTE_CHARS)?;
    let now = app.config.clock.now();
    let expires_at = new.expires_at.unwrap_or_else(|| good_until(now));
    if now.duration_until(expires_at) > LONGEST {
        let detail = format!(
            "expected a time within {} days, got {expires_at}",
            LONGEST.as_hours() / 24
        );
        return Err(Problem::invalid("expires_at", detail));
    }
    let secret = Secret::generate(SecretKind::Invitation).map_err(Problem::internal)?;
    let new = NewInvitation {
        code_hash: secret.hash(),
        invited_as,
        note,
        expires_at,
    };
    let invitation = app.store.invite(caller.actor(), new, now).await?;
    tracing::info!(invitation = %invitation.id, actor = %caller.actor(), "invited");
    let view = NewInvitationView {
        invitation: InvitationView::of(invitation, now),
        link: link(&app, secret.as_str()),
        code: secret.as_str().to_owned(),
    };
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
    let mut invitations = app.store.invitations().await?;
    invitations.retain(|invitation| may_manage(&caller, invitation));
    let page = page.cut(invitations, |invitation| invitation.id)?;
    Ok(page.map(|invitation| InvitationView::of(invitation, now)))
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
    let invitations = app.store.invitations().await?;
    let is_theirs = invitations
        .iter()
        .any(|invitation| invitation.id == id && may_manage(&caller, invitation));
    if !is_theirs {
        return Err(Problem::not_found("invitation"));
    }
    let now = app.config.clock.now();
    let invitation = app.store.revoke_invitation(caller.actor(), id, now).await?;
    Ok(Json(InvitationView::of(invitation, now)))
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
        who: WhoView::of(who, joined.token.into()),
        secret: secret.as_str().to_owned(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

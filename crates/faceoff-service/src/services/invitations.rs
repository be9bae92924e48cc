//! Invitations: creating, listing and revoking them. An *invitation* is a link with a secret code, by which a person gets an
//! account as organiser, as member or founder of a team, or a new password.

use super::accounts::{RESTORE_ACCESS_VALIDITY, default_expiry, join_link};
use crate::{
    app::AppState,
    auth::Caller,
    boxed_future,
    problem::{Problem, ProblemKind},
    text,
    views::invitation,
};
use faceoff_api::{
    requests::{self, InvitedRole},
    token::{Secret, SecretKind},
    views::invitation::{InvitationView, NewInvitationView},
};
use faceoff_store::{Invitation, InvitationRole, NewInvitation, Principal, StoreError};
use faceoff_types::InvitationId;
use jiff::SignedDuration;

/// Longest validity of an invitation.
const MAX_VALIDITY: SignedDuration = SignedDuration::from_hours(90 * 24);
/// Longest note on an invitation.
const MAX_NOTE_CHARS: usize = 80;

/// Whether the caller may see and revoke an invitation: organisers all, a member those to the own team.
fn may_manage(caller: &Caller, invitation: &Invitation) -> bool {
    match (&caller.principal, invitation.role) {
        (Principal::Operator | Principal::Organiser(_), _) => true,
        (Principal::Member(_, own_team), InvitationRole::Member(team)) => own_team.id == team,
        (Principal::Member(..) | Principal::Team(_), _) => false,
    }
}

/// The role that a new invitation gives.
///
/// # Errors
/// `Forbidden` if the caller may not invite to this role; `InvalidContent` for fields that do not fit the role.
fn invitation_role(
    caller: &Caller,
    new: &requests::NewInvitation,
) -> Result<InvitationRole, Problem> {
    let check_absent = |field: &str, is_present: bool| match is_present {
        true => Err(Problem::invalid(
            field,
            "expected no value for this role, got one; leave it out",
        )),
        false => Ok(()),
    };
    if new.role != InvitedRole::Member {
        check_absent("team", new.team.is_some())?;
    }
    if new.role != InvitedRole::RestoreAccess {
        check_absent("person", new.person.is_some())?;
    }
    let forbidden = |detail: &str| Err(Problem::new(ProblemKind::Forbidden, detail));
    match (&caller.principal, new.role) {
        (Principal::Team(_), _) => {
            forbidden("a team's token cannot invite; use a member's token, or an organiser's")
        }
        (Principal::Member(_, own_team), InvitedRole::Member) => match new.team {
            Some(team) if team != own_team.id => Err(Problem::not_found("team")),
            _ => Ok(InvitationRole::Member(own_team.id)),
        },
        (Principal::Member(..), _) => forbidden("a member can invite only members of their team"),
        (_, InvitedRole::Organiser) => Ok(InvitationRole::Organiser),
        (_, InvitedRole::Founder) => Ok(InvitationRole::Founder),
        (_, InvitedRole::Member) => new.team.map(InvitationRole::Member).ok_or_else(|| {
            Problem::invalid("team", "expected the id of the invited member's team")
        }),
        (_, InvitedRole::RestoreAccess) => new
            .person
            .map(InvitationRole::RestoreAccess)
            .ok_or_else(|| {
                Problem::invalid(
                    "person",
                    "expected the id of the user who gets access again",
                )
            }),
    }
}

/// At most `limit` of the invitations that the caller may manage, newest first. With `after`, those that come after this invitation;
/// `None` if it is not in the list.
#[boxed_future]
pub async fn invitations_after(
    app: &AppState,
    caller: &Caller,
    after: Option<InvitationId>,
    limit: u32,
) -> Result<Option<Vec<Invitation>>, Problem> {
    let team = match &caller.principal {
        Principal::Operator | Principal::Organiser(_) => None,
        Principal::Member(_, own_team) => Some(own_team.id),
        Principal::Team(_) => return Ok(after.is_none().then(Vec::new)),
    };
    Ok(app.store.invitations_after(team, after, limit).await?)
}

/// Creates an invitation. Only this response contains its link.
#[boxed_future]
pub async fn create_invitation(
    app: &AppState,
    caller: &Caller,
    new: requests::NewInvitation,
) -> Result<NewInvitationView, Problem> {
    let role = invitation_role(caller, &new)?;
    let note = text::single_line("note", &new.note, MAX_NOTE_CHARS)?;
    let now = app.config.clock.now();
    let expires_at = new
        .expires_at
        .unwrap_or_else(|| default_expiry(new.role, now));
    let max_validity = match new.role {
        InvitedRole::RestoreAccess => RESTORE_ACCESS_VALIDITY,
        InvitedRole::Organiser | InvitedRole::Member | InvitedRole::Founder => MAX_VALIDITY,
    };
    if now.duration_until(expires_at) > max_validity {
        let max = match max_validity.as_hours() {
            hours @ ..=48 => format!("{hours} hours"),
            hours => format!("{} days", hours / 24),
        };
        let detail = format!("expected a time within {max}, got {expires_at}");
        return Err(Problem::invalid("expires_at", detail));
    }
    let secret = Secret::generate(SecretKind::Invitation).map_err(Problem::internal)?;
    let new = NewInvitation {
        code_hash: secret.hash(),
        role,
        note,
        requester: caller.requester(),
        expires_at,
    };
    let invitation = app.store.invite(caller.actor(), new, now).await?;
    tracing::info!(invitation = %invitation.id, actor = %caller.actor(), "invited");
    Ok(NewInvitationView {
        invitation: invitation::view(invitation, now),
        link: join_link(app, secret.as_str()),
        code: secret.as_str().to_owned(),
    })
}

/// Revokes an invitation: its link is invalid from now on.
#[boxed_future]
pub async fn revoke_invitation(
    app: &AppState,
    caller: &Caller,
    id: InvitationId,
) -> Result<InvitationView, Problem> {
    match app.store.invitation(id).await {
        Ok(invitation) if may_manage(caller, &invitation) => {}
        Ok(_) | Err(StoreError::NotFound(_)) => return Err(Problem::not_found("invitation")),
        Err(error) => return Err(error.into()),
    }
    let now = app.config.clock.now();
    let invitation = app.store.revoke_invitation(caller.actor(), id, now).await?;
    Ok(invitation::view(invitation, now))
}

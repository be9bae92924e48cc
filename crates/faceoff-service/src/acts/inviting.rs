//! Links by which people join: made, seen and taken back.

use super::joining::{good_until, link};
use crate::{
    app::AppState,
    auth::Caller,
    boxed,
    problem::{Problem, ProblemKind},
    text,
    views::invitation,
};
use faceoff_api::{
    requests::{self, InvitedRole},
    token::{Secret, SecretKind},
    views::invitation::{InvitationView, NewInvitationView},
};
use faceoff_store::{Invitation, InvitedAs, NewInvitation, Who};
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

/// The invitations that the caller may manage, the newest first.
#[boxed]
pub async fn invitations(app: &AppState, caller: &Caller) -> Result<Vec<Invitation>, Problem> {
    let mut invitations = app.store.invitations().await?;
    invitations.retain(|invitation| may_manage(caller, invitation));
    Ok(invitations)
}

/// Makes an invitation and returns its link, once.
#[boxed]
pub async fn create_invitation(
    app: &AppState,
    caller: &Caller,
    new: requests::NewInvitation,
) -> Result<NewInvitationView, Problem> {
    let invited_as = invited_as(caller, &new)?;
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
    Ok(NewInvitationView {
        invitation: invitation::of(invitation, now),
        link: link(app, secret.as_str()),
        code: secret.as_str().to_owned(),
    })
}

/// From now on the invitation's link is worth nothing.
#[boxed]
pub async fn revoke_invitation(
    app: &AppState,
    caller: &Caller,
    id: InvitationId,
) -> Result<InvitationView, Problem> {
    let invitations = app.store.invitations().await?;
    let is_theirs = invitations
        .iter()
        .any(|invitation| invitation.id == id && may_manage(caller, invitation));
    if !is_theirs {
        return Err(Problem::not_found("invitation"));
    }
    let now = app.config.clock.now();
    let invitation = app.store.revoke_invitation(caller.actor(), id, now).await?;
    Ok(invitation::of(invitation, now))
}

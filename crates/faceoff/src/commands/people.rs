//! Users and invitations: their text, and the commands of organisers and members about invitations. An invited *founder* creates a new
//! team; a *return* restores a user's account.

use super::output::{print, print_list, time_text};
use crate::client::Client;
use faceoff_api::{
    requests::{InvitedRole, NewInvitation},
    views::{
        credentials::{ChangedAccessView, EndedCredentialsView},
        invitation::{InvitationView, NewInvitationView},
        user::UserView,
    },
};
use faceoff_types::InvitationId;

/// A user as one line.
pub(super) fn user_line(person: &UserView) -> String {
    let role = match person.team {
        Some(team) => format!("member of {team}"),
        None => "organiser".to_owned(),
    };
    let left = person
        .left_at
        .map_or_else(String::new, |at| format!("  left {}", time_text(at)));
    format!(
        "{}  {:<40} {role}  since {}{left}",
        person.id,
        person.name,
        person.joined_at.strftime("%Y-%m-%d")
    )
}

/// A user whose access has changed, and what ended with it.
pub(super) fn changed_access_text(changed: &ChangedAccessView) -> String {
    user_line(&changed.user) + &ended_text(changed.ended.as_ref())
}

/// One line for each credential that ended because its creator lost access; empty if none did.
pub(super) fn ended_text(ended: Option<&EndedCredentialsView>) -> String {
    let Some(ended) = ended else {
        return String::new();
    };
    let lines = ended.lines().into_iter();
    lines.map(|line| format!("\n{line}")).collect()
}

/// An invitation as one line.
fn invitation_line(invitation: &InvitationView) -> String {
    let role = match invitation.role {
        InvitedRole::Organiser => "organiser",
        InvitedRole::Member => "member",
        InvitedRole::Founder => "founder",
        InvitedRole::RestoreAccess => "return",
    };
    format!(
        "{}  {role:<10} {:<10} for {}, until {}",
        invitation.id,
        invitation.state,
        invitation.note,
        time_text(invitation.expires_at)
    )
}

/// A request for an invitation that names no team and no user.
pub(super) const fn new_invitation(role: InvitedRole, note: String) -> NewInvitation {
    NewInvitation {
        role,
        team: None,
        person: None,
        note,
        expires_at: None,
    }
}

/// Creates an invitation and prints it with its link.
pub(super) async fn invite(
    client: &Client,
    json: bool,
    invitation: NewInvitation,
) -> anyhow::Result<()> {
    let created = client.invite(&invitation).await?;
    print(json, &created, new_invitation_text)
}

/// Prints the invitations that the caller may manage.
pub(super) async fn list_invitations(client: &Client, json: bool) -> anyhow::Result<()> {
    let invitations = client.invitations().await?;
    print_list(json, &invitations, invitation_line, "no invitations yet")
}

/// Revokes an invitation and prints it.
pub(super) async fn uninvite(
    client: &Client,
    json: bool,
    invitation: InvitationId,
) -> anyhow::Result<()> {
    let revoked = client.revoke_invitation(invitation).await?;
    print(json, &revoked, invitation_line)
}

/// A new invitation, with its link.
fn new_invitation_text(new: &NewInvitationView) -> String {
    format!(
        "{}\n{}\nThe link is not shown again; it can be used once.",
        invitation_line(&new.invitation),
        new.link
    )
}

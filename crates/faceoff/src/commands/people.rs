//! Text of users and invitations. An invited *founder* creates a new team; a *return* restores a user's account.

use super::output::lines_or;
use faceoff_api::{
    requests::InvitedRole,
    views::{
        invitation::{InvitationView, NewInvitationView},
        user::UserView,
    },
};

/// A user as one line.
pub(super) fn user_line(person: &UserView) -> String {
    let role = match person.team {
        Some(team) => format!("member of {team}"),
        None => "organiser".to_owned(),
    };
    let left = person.left_at.map_or_else(String::new, |at| {
        format!("  left {}", at.strftime("%Y-%m-%d %H:%M UTC"))
    });
    format!(
        "{}  {:<40} {role}  since {}{left}",
        person.id,
        person.name,
        person.joined_at.strftime("%Y-%m-%d")
    )
}

/// An invitation as one line.
pub(super) fn invitation_line(invitation: &InvitationView) -> String {
    let role = match invitation.role {
        InvitedRole::Organiser => "organiser",
        InvitedRole::Member => "member",
        InvitedRole::Founder => "founder",
        InvitedRole::Return => "return",
    };
    format!(
        "{}  {role:<10} {:<10} for {}, until {}",
        invitation.id,
        invitation.state,
        invitation.note,
        invitation.expires_at.strftime("%Y-%m-%d %H:%M UTC")
    )
}

/// A new invitation, with its link.
pub(super) fn new_invitation_text(new: &NewInvitationView) -> String {
    format!(
        "{}\n{}\nThe link is not shown again; it can be used once.",
        invitation_line(&new.invitation),
        new.link
    )
}

pub(super) fn invitation_lines(invitations: &[InvitationView]) -> String {
    let lines = invitations.iter().map(invitation_line).collect();
    lines_or(lines, "no invitations yet")
}

//! How commands print people and invitations.

use super::output::or_none;
use faceoff_api::{
    requests::InvitedRole,
    views::{
        invitation::{InvitationView, NewInvitationView},
        person::PersonView,
    },
};

/// A person in a list.
pub(super) fn person_line(person: &PersonView) -> String {
    let of = match person.team {
        Some(team) => format!("member of {team}"),
        None => "organiser".to_owned(),
    };
    let left = person.left_at.map_or_else(String::new, |at| {
        format!("  left {}", at.strftime("%Y-%m-%d %H:%M UTC"))
    });
    format!(
        "{}  {:<40} {of}  since {}{left}",
        person.id,
        person.name,
        person.joined_at.strftime("%Y-%m-%d")
    )
}

/// An invitation in a list.
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
pub(super) fn invited(made: &NewInvitationView) -> String {
    format!(
        "{}\n{}\nIt is not shown again; it is good for one person, once.",
        invitation_line(&made.invitation),
        made.link
    )
}

pub(super) fn invitation_lines(invitations: &[InvitationView]) -> String {
    let lines = invitations.iter().map(invitation_line).collect();
    or_none(lines, "nobody was invited yet")
}

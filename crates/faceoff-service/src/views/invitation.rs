//! Invitations (links by which a person gets an account) and registrations of new teams.

use faceoff_api::{
    requests::InvitedRole,
    views::invitation::{InvitationView, RegistrationView},
};
use faceoff_store::{Invitation, InvitationRole, InvitationState, Registration, RegistrationState};
use jiff::Timestamp;

/// The invitation's state at `now`.
pub fn view(invitation: Invitation, now: Timestamp) -> InvitationView {
    let (role, team, person) = match invitation.role {
        InvitationRole::Organiser => (InvitedRole::Organiser, None, None),
        InvitationRole::Member(team) => (InvitedRole::Member, Some(team), None),
        InvitationRole::Founder => (InvitedRole::Founder, None, None),
        InvitationRole::RestoreAccess(person) => (InvitedRole::RestoreAccess, None, Some(person)),
    };
    let (state, accepted_by) = match invitation.state {
        InvitationState::Accepted { user, .. } => ("accepted", Some(user)),
        InvitationState::Revoked { .. } => ("revoked", None),
        InvitationState::Unused if invitation.expires_at <= now => ("expired", None),
        InvitationState::Unused => ("open", None),
    };
    InvitationView {
        id: invitation.id,
        role,
        team,
        person,
        note: invitation.note,
        made_by: invitation.creator.user,
        created_at: invitation.created_at,
        expires_at: invitation.expires_at,
        state: state.into(),
        accepted_by,
    }
}

pub fn registration(registration: Registration) -> RegistrationView {
    let (state, decided_at, reason, team) = match registration.state {
        RegistrationState::Pending => ("waiting", None, None, None),
        RegistrationState::Approved { at, team } => ("approved", Some(at), None, Some(team)),
        RegistrationState::Refused { at, reason } => ("refused", Some(at), Some(reason), None),
    };
    RegistrationView {
        id: registration.id,
        team_name: registration.team_name,
        affiliation: registration.affiliation,
        link: registration.link,
        division: registration.division,
        contact: registration.contact,
        accepted_terms: registration.accepted_terms,
        created_at: registration.created_at,
        state: state.into(),
        decided_at,
        reason,
        team,
    }
}

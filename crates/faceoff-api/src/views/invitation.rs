//! Invitations, with which a person joins as an organiser or a team's member, and registrations, with which a new team asks
//! to take part.

use crate::requests::InvitedRole;
use faceoff_types::{DivisionName, InvitationId, RegistrationId, TeamId, TeamName, UserId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An invitation for one person, which can be used once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InvitationView {
    /// Id of the invitation; does not reveal the link.
    pub id: InvitationId,
    /// The role that the invitation gives.
    pub role: InvitedRole,
    /// The team of a future member; absent for other roles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// The user who gets access again; absent for other roles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<UserId>,
    /// A label for lists, e.g. the invited person's name.
    pub note: String,
    /// The user who made it; null: the operator, or the server for a registered team.
    pub made_by: Option<UserId>,
    /// When it was created.
    pub created_at: Timestamp,
    /// When it expires.
    pub expires_at: Timestamp,
    /// `open`, `accepted`, `revoked` or `expired`.
    #[schema(example = "open")]
    pub state: String,
    /// The user who accepted it; absent before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_by: Option<UserId>,
}

/// A new invitation with its link, which is shown only once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewInvitationView {
    /// The invitation.
    #[serde(flatten)]
    pub invitation: InvitationView,
    /// The code; the server stores only its hash.
    #[schema(example = "fo_invite_…")]
    pub code: String,
    /// Page on which the invitation is accepted: a URL, or a path if the server's public URL is not configured.
    #[schema(example = "/join/fo_invite_…")]
    pub link: String,
}

/// A team's registration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RegistrationView {
    /// Id of the registration; does not reveal its link.
    pub id: RegistrationId,
    /// The requested team name.
    pub team_name: TeamName,
    /// The team's institution or company; null if not given.
    pub affiliation: Option<String>,
    /// The team's web page; null if not given.
    pub link: Option<String>,
    /// The requested division; null if not given.
    pub division: Option<DivisionName>,
    /// How the organisers can reach the team.
    pub contact: String,
    /// The accepted version of the terms; null without terms.
    pub accepted_terms: Option<u32>,
    /// When the team registered.
    pub created_at: Timestamp,
    /// `waiting`, `approved` or `refused`.
    #[schema(example = "waiting")]
    pub state: String,
    /// When it was approved or refused; absent before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decided_at: Option<Timestamp>,
    /// Why it was refused; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Id of the created team; absent unless approved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
}

/// A new registration with its link, which is shown only once. The link is valid once the organisers have approved the
/// registration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewRegistrationView {
    /// The registration.
    #[serde(flatten)]
    pub registration: RegistrationView,
    /// The code; the server stores only its hash.
    #[schema(example = "fo_invite_…")]
    pub code: String,
    /// Page that shows the registration's state and lets the first member join.
    #[schema(example = "/join/fo_invite_…")]
    pub join_link: String,
}

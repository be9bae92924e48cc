//! Invitations and registrations.

use crate::requests::InvitedRole;
use faceoff_types::{DivisionName, InvitationId, PersonId, RegistrationId, TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A link by which one person joins, once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InvitationView {
    /// Names it; tells nothing of the link.
    pub id: InvitationId,
    /// What it makes of whoever follows it.
    pub role: InvitedRole,
    /// Of a member.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// Who is to return.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<PersonId>,
    /// For whom it is.
    pub note: String,
    /// When it was made.
    pub created_at: Timestamp,
    /// From then on it is worth nothing.
    pub expires_at: Timestamp,
    /// `open`, `accepted`, `revoked` or `expired`.
    #[schema(example = "open")]
    pub state: String,
    /// Who has accepted it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_by: Option<PersonId>,
}

/// A new invitation with its link, which is shown this once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewInvitationView {
    /// What is stored of it.
    #[serde(flatten)]
    pub invitation: InvitationView,
    /// The code; only its hash is stored.
    #[schema(example = "fo_invite_…")]
    pub code: String,
    /// The page where it is accepted: an address, or a path of this server if it does not know its own.
    #[schema(example = "/join/fo_invite_…")]
    pub link: String,
}

/// A team that wants to take part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RegistrationView {
    /// Names it; tells nothing of its link.
    pub id: RegistrationId,
    /// What it wants to be called.
    pub team_name: TeamName,
    /// Where it is from.
    pub affiliation: Option<String>,
    /// Its page.
    pub link: Option<String>,
    /// The division that it wants to be in.
    pub division: Option<DivisionName>,
    /// How the organisers reach it.
    pub contact: String,
    /// Which terms it has accepted.
    pub accepted_terms: Option<u32>,
    /// When it came.
    pub created_at: Timestamp,
    /// `waiting`, `approved` or `refused`.
    #[schema(example = "waiting")]
    pub state: String,
    /// When it was decided about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decided_at: Option<Timestamp>,
    /// Why it was refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The team that came of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
}

/// A registration with its link, which is shown this once: it is worth something once the organisers have approved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewRegistrationView {
    /// What is stored of it.
    #[serde(flatten)]
    pub registration: RegistrationView,
    /// The code; only its hash is stored.
    #[schema(example = "fo_invite_…")]
    pub code: String,
    /// The page that says where it stands, and lets the first member join.
    #[schema(example = "/join/fo_invite_…")]
    pub join_link: String,
}

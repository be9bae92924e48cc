//! People, and who the caller is.

use crate::views::{team::TeamView, token::TokenView};
use faceoff_types::{PersonId, PersonName, TeamId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Somebody with an account: an organiser, or a member of a team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PersonView {
    /// Names the person in paths and in the log.
    pub id: PersonId,
    /// By which they sign in.
    pub name: PersonName,
    /// `organiser` or `member`.
    #[schema(example = "member")]
    pub role: String,
    /// Whose member they are; null: an organiser.
    pub team: Option<TeamId>,
    /// When they followed their invitation.
    pub joined_at: Timestamp,
    /// Since when they may do nothing any more; null: they may.
    pub left_at: Option<Timestamp>,
    /// Which version of the terms they have accepted.
    pub accepted_terms: Option<u32>,
}

/// Who is calling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WhoView {
    /// `organiser`, `member`, `team` (a program with a team's own token), or `host` (the token in the data folder, which
    /// may do what organisers may).
    #[schema(example = "member")]
    pub role: String,
    /// The person; null of a team's program and the host.
    pub person: Option<PersonView>,
    /// Their team; null of organisers and the host.
    pub team: Option<TeamView>,
    /// With what they call.
    pub token: TokenView,
}

/// Who has joined, with a new token, which is shown this once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct JoinedView {
    /// They, as they call from now on.
    #[serde(flatten)]
    pub who: WhoView,
    /// The bearer token; only its hash is stored.
    #[schema(example = "fo_person_…")]
    pub secret: String,
}

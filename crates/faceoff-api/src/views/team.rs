//! Teams, and their tokens as they are handed out.

use crate::views::ruling::RulingView;
use faceoff_types::{DivisionName, TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TeamView {
    /// Names the team in paths; a name may hold spaces.
    pub id: TeamId,
    /// As the board shows it.
    #[schema(example = "AiRLIHockey")]
    pub name: TeamName,
    /// When it came.
    pub created_at: Timestamp,
    /// It neither plays nor is ranked, if it is; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disqualified: Option<RulingView>,
    /// Where it is from; null: it does not say.
    #[serde(default)]
    pub affiliation: Option<String>,
    /// Its page; null: none.
    #[serde(default)]
    pub link: Option<String>,
    /// The division that it is in; null: none.
    #[serde(default)]
    pub division: Option<DivisionName>,
    /// Since when it plays no more, by its own wish; null: it plays.
    #[serde(default)]
    pub retired_at: Option<Timestamp>,
    /// It is a reference agent of the organisers: boards show it apart and do not rank it; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub baseline: bool,
    /// Does it play no friendly games that other teams ask for? Told of a single team; absent in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declines_friendly_games: Option<bool>,
}

/// A team and its new token, which is shown this once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct TeamWithToken {
    /// Whose token it is.
    #[serde(flatten)]
    pub team: TeamView,
    /// The bearer token; only its hash is stored.
    #[schema(example = "fo_team_…")]
    pub token: String,
}

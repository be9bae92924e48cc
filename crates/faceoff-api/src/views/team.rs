//! Teams, and their first tokens.

use crate::views::decision::DecisionView;
use faceoff_types::{DivisionName, TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TeamView {
    /// Id of the team.
    pub id: TeamId,
    /// Name of the team; may contain spaces.
    #[schema(example = "AiRLIHockey")]
    pub name: TeamName,
    /// When the team was created.
    pub created_at: Timestamp,
    /// If the team is disqualified, and neither evaluated nor ranked: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disqualified: Option<DecisionView>,
    /// The team's institution or company; null if not given.
    #[serde(default)]
    pub affiliation: Option<String>,
    /// The team's web page; null if not given.
    #[serde(default)]
    pub link: Option<String>,
    /// The team's division; null without one.
    #[serde(default)]
    pub division: Option<DivisionName>,
    /// When the team retired; null while it takes part.
    #[serde(default)]
    pub retired_at: Option<Timestamp>,
    /// True if the team is a reference agent of the organisers, which boards show unranked; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub baseline: bool,
    /// Whether the team declines friendly games that other teams ask for; absent in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declines_friendly_games: Option<bool>,
}

/// A team and its new token, which is shown only once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct TeamWithToken {
    /// The team.
    #[serde(flatten)]
    pub team: TeamView,
    /// The bearer token; the server stores only its hash.
    #[schema(example = "fo_team_…")]
    pub token: String,
}

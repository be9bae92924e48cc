//! What clients send to the API.

use faceoff_types::Profile;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A team to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTeam {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: String,
}

/// How today's evaluations shall differ from the configuration. All fields may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartDay {
    /// Episodes of each task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_task: Option<u32>,
    /// The perturbations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
}

/// Why an evaluation is stopped.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cancellation {
    /// Shown to the team; 1 to 500 characters.
    pub reason: String,
}

/// What the ablation shall play. All fields may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OrderAblation {
    /// Episodes of each task in each of the six profiles; 100 unless given.
    pub episodes_per_task: Option<u32>,
}

/// The wish to close the season.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloseSeason {
    /// The season's name, to show that this is no slip: closing cannot be undone.
    pub confirm: String,
}

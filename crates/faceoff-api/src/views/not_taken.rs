//! Who does not play where, since a stage does not take the agent's runtime.

use faceoff_types::{StageId, StageName, SubmissionId, TeamId, TeamName};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A stage that a submission does not play in: nobody's fault, and no turn is taken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NotTakenView {
    /// Which.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// What it takes, and what came.
    pub reason: String,
}

/// A team that does not play a day.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NotTakenTeam {
    /// Which.
    pub team: TeamId,
    /// As the board shows it.
    pub team_name: TeamName,
    /// What it has active.
    pub submission: SubmissionId,
    /// What the stage takes, and what came.
    pub reason: String,
}

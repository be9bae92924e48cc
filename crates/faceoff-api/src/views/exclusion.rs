//! Exclusions: submissions that a stage does not evaluate, because it does not accept their runtime (the environment in which
//! their agent runs).

use faceoff_types::{StageId, StageName, SubmissionId, TeamId, TeamName};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A stage that excludes a submission. This is no fault of the agent and uses up no evaluation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StageExclusion {
    /// Id of the stage.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// The runtimes that it accepts, and the submission's.
    pub reason: String,
}

/// A team whose active submission a stage excludes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ExcludedTeam {
    /// Id of the team.
    pub team: TeamId,
    /// Name of the team.
    pub team_name: TeamName,
    /// The active submission.
    pub submission: SubmissionId,
    /// The runtimes that the stage accepts, and the submission's.
    pub reason: String,
}

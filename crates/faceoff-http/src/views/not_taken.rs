//! Who does not play where, since a stage does not take the agent's runtime.

use crate::{app::AppState, problem::Problem};
use faceoff_store::{Stage, StagePhase, Submission, SubmissionState};
use faceoff_types::{StageId, StageName, SubmissionId, TeamId, TeamName};
use jiff::Timestamp;
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

/// The stages that are not over and do not take a valid submission.
pub(super) fn by_stages(
    stages: &[Stage],
    submission: &Submission,
    now: Timestamp,
) -> Vec<NotTakenView> {
    if submission.state != SubmissionState::Valid {
        return Vec::new();
    }
    let refusal = |stage: &Stage| {
        Some(NotTakenView {
            stage: stage.id,
            stage_name: stage.name.clone(),
            reason: stage.check_takes(submission).err()?.to_string(),
        })
    };
    let to_come = stages
        .iter()
        .filter(|stage| stage.phase(now) != StagePhase::Closed);
    to_come.filter_map(refusal).collect()
}

/// The teams whose active submissions a stage does not take.
pub(super) async fn by(app: &AppState, stage: &Stage) -> Result<Vec<NotTakenTeam>, Problem> {
    let mut left_out = Vec::new();
    for submission in app.store.active_submissions().await? {
        if let Err(why) = stage.check_takes(&submission) {
            left_out.push(NotTakenTeam {
                team: submission.team,
                team_name: app.store.team(submission.team).await?.name,
                submission: submission.id,
                reason: why.to_string(),
            });
        }
    }
    Ok(left_out)
}

//! Who does not play where, since a stage does not take the agent's runtime.

use crate::{app::AppState, problem::Problem};
use faceoff_api::views::not_taken::{NotTakenTeam, NotTakenView};
use faceoff_store::{Stage, StagePhase, Submission, SubmissionState};
use jiff::Timestamp;

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

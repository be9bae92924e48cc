//! Exclusions: a stage excludes a submission if it does not accept its *runtime* (environment such as Python).

use crate::{app::AppState, problem::Problem};
use faceoff_api::views::exclusion::{ExcludedTeam, StageExclusion};
use faceoff_store::{Stage, StagePhase, Submission, SubmissionState};
use jiff::Timestamp;

/// The stages that have not closed and exclude a valid submission.
pub(super) fn excluding_stages(
    stages: &[Stage],
    submission: &Submission,
    now: Timestamp,
) -> Vec<StageExclusion> {
    if submission.state != SubmissionState::Valid {
        return Vec::new();
    }
    let exclusion = |stage: &Stage| {
        Some(StageExclusion {
            stage: stage.id,
            stage_name: stage.name.clone(),
            reason: stage.check_accepts(submission).err()?.to_string(),
        })
    };
    let not_closed = stages
        .iter()
        .filter(|stage| stage.phase(now) != StagePhase::Closed);
    not_closed.filter_map(exclusion).collect()
}

/// The teams whose active submissions a stage excludes.
pub(super) async fn excluded_teams(
    app: &AppState,
    stage: &Stage,
) -> Result<Vec<ExcludedTeam>, Problem> {
    let mut excluded = Vec::new();
    for submission in app.store.active_submissions().await? {
        if let Err(refusal) = stage.check_accepts(&submission) {
            excluded.push(ExcludedTeam {
                team: submission.team,
                team_name: app.store.team(submission.team).await?.name,
                submission: submission.id,
                reason: refusal.to_string(),
            });
        }
    }
    Ok(excluded)
}

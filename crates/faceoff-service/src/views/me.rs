//! A team's own status: today's evaluation, and the submission that the next cutoff evaluates.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    viewer::Viewer,
    views::{day, evaluation, stage, submission, team, visibility::Visibility},
};
use faceoff_api::views::{
    me::{MeView, PendingValidationView, TodayView},
    submission::SubmissionStatus,
};
use faceoff_store::{Evaluation, EvaluationState, Team};

/// The status of a team.
#[boxed_future]
pub async fn build(app: &AppState, team: Team) -> Result<MeView, Problem> {
    let visibility = Visibility::load(app, Viewer::Team(team.id)).await?;
    let today = stage::current(app).await?.day(app.config.clock.now());
    let counts_for_day = |evaluation: &Evaluation| {
        let has_no_result = matches!(
            evaluation.state,
            EvaluationState::PlatformFailed { .. }
                | EvaluationState::DeadlineMissed { .. }
                | EvaluationState::Cancelled { .. }
        );
        !has_no_result && evaluation.voided.is_none()
    };
    let evaluations = app.store.evaluations_of(team.id).await?;
    let evaluation = evaluations
        .iter()
        .find(|evaluation| evaluation.stage_day == today && counts_for_day(evaluation))
        .cloned();
    let evaluation = match evaluation {
        Some(evaluation) => Some(evaluation::build(app, &visibility, evaluation).await?),
        None => None,
    };
    let submissions = submission::team_submissions(app, team.id).await?;
    let validating = submissions
        .iter()
        .filter(|submission| submission.status == SubmissionStatus::Validating)
        .map(|submission| PendingValidationView {
            submission: submission.id,
            queue: submission.queue,
            next: submission.next.clone(),
        });
    let active = submissions.iter().find(|submission| submission.active);
    Ok(MeView {
        team: team::view(team),
        today: TodayView {
            stage: today.stage,
            day: today.date,
            evaluation: evaluation.as_ref().map(|evaluation| evaluation.id),
            queue: evaluation.as_ref().and_then(|evaluation| evaluation.queue),
            next: evaluation.map(|evaluation| evaluation.next),
        },
        validating: validating.collect(),
        active_submission: active.map(|submission| submission.id),
        excluded_by: active.map_or_else(Vec::new, |active| active.excluded_by.clone()),
        next_cutoff: day::first_cutoff(app).await?,
        max_bundle_bytes: app.config.max_bundle_bytes,
    })
}

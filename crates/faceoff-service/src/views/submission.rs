//! Submissions, with the verdicts of their validation runs. A *validation run* checks that the agent of a
//! submission starts, responds, and meets its time limits.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{decision, exclusions, queue},
};
use faceoff_api::views::{
    printable,
    submission::{DeletionView, SubmissionStatus, SubmissionView},
};
use faceoff_store::{Stage, Submission, SubmissionState};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;

/// Text of the field `next`, which says what happens next, for a valid submission whose bundle was removed.
const BUNDLE_REMOVED: &str = "It cannot be evaluated any more: its bundle was deleted. Its results stay; to evaluate it again, upload it again.";

/// A submission with its log and its position in the queue.
#[boxed_future]
pub async fn find(app: &AppState, id: SubmissionId) -> Result<SubmissionView, Problem> {
    build(app, app.store.submission(id).await?).await
}

/// A submission with its log and its position in the queue.
#[boxed_future]
pub async fn build(app: &AppState, submission: Submission) -> Result<SubmissionView, Problem> {
    let log = app.store.submission_log(submission.id).await?;
    let (stages, now) = (app.store.stages().await?, app.config.clock.now());
    let mut view = view(submission, log, &stages, now);
    add_queue_positions(app, std::slice::from_mut(&mut view)).await?;
    Ok(view)
}

/// The submissions of a team, newest first.
#[boxed_future]
pub async fn team_submissions(
    app: &AppState,
    team: TeamId,
) -> Result<Vec<SubmissionView>, Problem> {
    all(app, app.store.submissions_of(team).await?).await
}

/// Views of these submissions, in order; without their logs, which are long.
#[boxed_future]
pub async fn all(
    app: &AppState,
    submissions: Vec<Submission>,
) -> Result<Vec<SubmissionView>, Problem> {
    let (stages, now) = (app.store.stages().await?, app.config.clock.now());
    let without_log = |submission| view(submission, None, &stages, now);
    let mut views: Vec<SubmissionView> = submissions.into_iter().map(without_log).collect();
    add_queue_positions(app, &mut views).await?;
    Ok(views)
}

/// Adds positions in the queue to submissions that wait for their validation run. If none waits, the database is not read.
async fn add_queue_positions(app: &AppState, views: &mut [SubmissionView]) -> Result<(), Problem> {
    if views
        .iter()
        .all(|view| view.status != SubmissionStatus::Validating)
    {
        return Ok(());
    }
    let forecast = queue::forecast(app).await?;
    for view in views {
        view.queue = forecast.submissions.get(&view.id).copied().map(queue::view);
    }
    Ok(())
}

/// A submission without its position in the queue.
pub fn view(
    submission: Submission,
    log: Option<String>,
    stages: &[Stage],
    now: Timestamp,
) -> SubmissionView {
    let exclusions = exclusions::excluding_stages(stages, &submission, now);
    let status = match submission.state {
        SubmissionState::Validating => SubmissionStatus::Validating,
        SubmissionState::Valid => SubmissionStatus::Valid {
            log: log.map(printable),
        },
        SubmissionState::Invalid { reason } => SubmissionStatus::Invalid {
            reason: printable(reason),
            log: log.map(printable),
        },
        // The reason may contain a file name from the bundle.
        SubmissionState::PlatformFailed { reason } => SubmissionStatus::PlatformFailed {
            reason: printable(reason),
        },
    };
    let is_withdrawn = submission.withdrawn_at.is_some();
    let is_removed =
        matches!(status, SubmissionStatus::Valid { .. }) && submission.bundle_removed.is_some();
    let next = if is_removed {
        BUNDLE_REMOVED.to_owned()
    } else {
        let mut next = status.next(submission.active, is_withdrawn).to_owned();
        for exclusion in &exclusions {
            next.push_str(&format!(" One stage excludes it: {}.", exclusion.reason));
        }
        next
    };
    SubmissionView {
        id: submission.id,
        team: submission.team,
        file_name: submission.bundle.file_name,
        bytes: submission.bundle.bytes,
        blake3: submission.bundle.blake3,
        created_at: submission.created_at,
        agent_name: submission.agent_name.map(printable),
        runtime: submission.runtime,
        excluded_by: exclusions,
        timing: submission.timing,
        active: submission.active,
        withdrawn_at: submission.withdrawn_at,
        label: submission.label.map(printable),
        note: submission.note.map(printable),
        same_as: submission.duplicate_of,
        bundle_removed: submission.bundle_removed.map(decision::view),
        deleted: submission.deletion_request.map(|request| DeletionView {
            at: request.requested_at,
            by: request.actor.to_string(),
        }),
        queue: None,
        next,
        status,
    }
}

//! An uploaded agent and its smoke run's verdict.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{not_taken, queue, ruling},
};
use faceoff_api::views::{
    shown,
    submission::{DeletedView, SubmissionStatus, SubmissionView},
};
use faceoff_store::{Stage, Submission, SubmissionState};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;

/// What happens next to what was valid and has no archive any more.
const GONE: &str = "It plays nothing any more: its archive was removed. What it has played stays; to play it again, upload it again.";

/// One, with its log.
#[boxed]
pub async fn find(app: &AppState, id: SubmissionId) -> Result<SubmissionView, Problem> {
    of(app, app.store.submission(id).await?).await
}

#[boxed]
pub async fn of(app: &AppState, submission: Submission) -> Result<SubmissionView, Problem> {
    let log = app.store.submission_log(submission.id).await?;
    let (stages, now) = (app.store.stages().await?, app.config.clock.now());
    let mut view = view(submission, log, &stages, now);
    place(app, std::slice::from_mut(&mut view)).await?;
    Ok(view)
}

/// Of a team, newest first.
#[boxed]
pub async fn of_team(app: &AppState, team: TeamId) -> Result<Vec<SubmissionView>, Problem> {
    all(app, app.store.submissions_of(team).await?).await
}

/// These, in their order; without their logs, which are long.
#[boxed]
pub async fn all(
    app: &AppState,
    submissions: Vec<Submission>,
) -> Result<Vec<SubmissionView>, Problem> {
    let (stages, now) = (app.store.stages().await?, app.config.clock.now());
    let without_log = |submission| view(submission, None, &stages, now);
    let mut views: Vec<SubmissionView> = submissions.into_iter().map(without_log).collect();
    place(app, &mut views).await?;
    Ok(views)
}

/// Tells of those that wait for their smoke run where they stand. If none does, nothing is read.
async fn place(app: &AppState, views: &mut [SubmissionView]) -> Result<(), Problem> {
    if views
        .iter()
        .all(|view| view.status != SubmissionStatus::Validating)
    {
        return Ok(());
    }
    let outlook = queue::outlook(app).await?;
    for view in views {
        view.queue = outlook.submissions.get(&view.id).copied().map(queue::of);
    }
    Ok(())
}

/// One, without its place in the queue.
pub fn view(
    submission: Submission,
    log: Option<String>,
    stages: &[Stage],
    now: Timestamp,
) -> SubmissionView {
    let not_taken = not_taken::by_stages(stages, &submission, now);
    let status = match submission.state {
        SubmissionState::Validating => SubmissionStatus::Validating,
        SubmissionState::Valid => SubmissionStatus::Valid {
            log: log.map(shown),
        },
        SubmissionState::Invalid { reason } => SubmissionStatus::Invalid {
            reason: shown(reason),
            log: log.map(shown),
        },
        // It may name a file of the bundle.
        SubmissionState::ValidationError { reason } => SubmissionStatus::ValidationError {
            reason: shown(reason),
        },
    };
    let is_withdrawn = submission.withdrawn_at.is_some();
    let is_gone =
        matches!(status, SubmissionStatus::Valid { .. }) && submission.archive_removed.is_some();
    let next = if is_gone {
        GONE.to_owned()
    } else {
        let mut next = status.next(submission.active, is_withdrawn).to_owned();
        for one in &not_taken {
            next.push_str(&format!(" It plays no day of one stage: {}.", one.reason));
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
        agent_name: submission.agent_name.map(shown),
        runtime: submission.runtime,
        not_taken,
        timing: submission.timing,
        active: submission.active,
        withdrawn_at: submission.withdrawn_at,
        label: submission.label.map(shown),
        note: submission.note.map(shown),
        same_as: submission.same_as,
        archive_removed: submission.archive_removed.map(ruling::of),
        deleted: submission.deleted.map(|deleted| DeletedView {
            at: deleted.at,
            by: deleted.by.to_string(),
        }),
        queue: None,
        next,
        status,
    }
}

//! Activating, withdrawing and describing submissions. The *active* submission of a team is the one that the next cutoff
//! evaluates.

use crate::{
    app::AppState,
    auth::TeamCaller,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_api::requests::SubmissionChange;
use faceoff_store::{Submission, SubmissionDescription};
use faceoff_types::SubmissionId;

/// Longest label of a submission.
const MAX_LABEL_CHARS: usize = 80;

/// Longest note on a submission.
const MAX_NOTE_CHARS: usize = 2000;

/// Refuses a submission of another team.
async fn check_own(app: &AppState, caller: &TeamCaller, id: SubmissionId) -> Result<(), Problem> {
    let submission = app.store.submission(id).await;
    caller.visible("submission", submission, |submission| submission.team)?;
    Ok(())
}

/// Activates a submission: the next cutoff evaluates it.
#[boxed_future]
pub async fn activate_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
) -> Result<Submission, Problem> {
    let (actor, name) = (caller.actor(), &caller.team.name);
    check_own(app, caller, id).await?;
    let now = app.config.clock.now();
    let submission = app.store.activate_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission activated");
    Ok(submission)
}

/// Withdraws a submission from further evaluations.
#[boxed_future]
pub async fn withdraw_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
) -> Result<Submission, Problem> {
    let (actor, name) = (caller.actor(), &caller.team.name);
    check_own(app, caller, id).await?;
    let now = app.config.clock.now();
    let submission = app.store.withdraw_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission withdrawn");
    Ok(submission)
}

/// Changes label and note of a submission.
#[boxed_future]
pub async fn describe_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
    change: &SubmissionChange,
) -> Result<Submission, Problem> {
    check_own(app, caller, id).await?;
    let description = SubmissionDescription {
        label: checked_text("label", &change.label, MAX_LABEL_CHARS)?,
        note: checked_text("note", &change.note, MAX_NOTE_CHARS)?,
    };
    if description.label.is_none() && description.note.is_none() {
        let detail = "expected label, note, or both, got neither; add one of them";
        return Err(Problem::new(ProblemKind::InvalidContent, detail));
    }
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let described = app.store.describe_submission(actor, id, description, now);
    Ok(described.await?)
}

/// The trimmed text of a field, if it is not too long. `None`: the field is left out; `Some(None)`: it is null.
#[expect(
    clippy::option_option,
    reason = "null differs from a field that is left out"
)]
fn checked_text<'t>(
    field: &str,
    text: &'t Option<Option<String>>,
    max_chars: usize,
) -> Result<Option<Option<&'t str>>, Problem> {
    let text = text.as_ref().map(|text| text.as_deref().map(str::trim));
    // 1 stands for null or no field, which are valid.
    let chars = text.flatten().map_or(1, |text| text.chars().count());
    if !(1..=max_chars).contains(&chars) {
        let detail = format!("expected 1 to {max_chars} characters, or null, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    Ok(text)
}

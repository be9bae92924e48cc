//! What of a team's submissions plays, and what the team says of them.

use crate::{
    app::AppState,
    auth::TeamCaller,
    boxed,
    problem::{Problem, ProblemKind},
    views::submission,
};
use faceoff_api::{requests::SubmissionChange, views::submission::SubmissionView};
use faceoff_store::SubmissionWords;
use faceoff_types::SubmissionId;

/// Longest name that a team has for a submission.
const MAX_LABEL_CHARS: usize = 80;

/// Longest note of a team on a submission.
const MAX_NOTE_CHARS: usize = 2000;

async fn check_own(app: &AppState, caller: &TeamCaller, id: SubmissionId) -> Result<(), Problem> {
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    Ok(())
}

/// Chooses what the team enters at the next cut.
#[boxed]
pub async fn activate_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
) -> Result<SubmissionView, Problem> {
    let (actor, name) = (caller.actor(), &caller.team.name);
    check_own(app, caller, id).await?;
    let now = app.config.clock.now();
    let submission = app.store.activate_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission activated");
    submission::of(app, submission).await
}

/// Takes a submission back.
#[boxed]
pub async fn withdraw_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
) -> Result<SubmissionView, Problem> {
    let (actor, name) = (caller.actor(), &caller.team.name);
    check_own(app, caller, id).await?;
    let now = app.config.clock.now();
    let submission = app.store.withdraw_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission withdrawn");
    submission::of(app, submission).await
}

/// Changes what a team says of a submission.
#[boxed]
pub async fn describe_submission(
    app: &AppState,
    caller: &TeamCaller,
    id: SubmissionId,
    change: &SubmissionChange,
) -> Result<SubmissionView, Problem> {
    check_own(app, caller, id).await?;
    let words = SubmissionWords {
        label: said("label", &change.label, MAX_LABEL_CHARS)?,
        note: said("note", &change.note, MAX_NOTE_CHARS)?,
    };
    if words.label.is_none() && words.note.is_none() {
        let detail = "expected label, note, or both; there is nothing to change";
        return Err(Problem::new(ProblemKind::InvalidContent, detail));
    }
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let submission = app.store.describe_submission(actor, id, words, now).await?;
    submission::of(app, submission).await
}

/// Words without the space around them, if they are given and not too many.
#[expect(clippy::option_option, reason = "null and left out are told apart")]
fn said<'w>(
    field: &str,
    words: &'w Option<Option<String>>,
    most_chars: usize,
) -> Result<Option<Option<&'w str>>, Problem> {
    let words = words.as_ref().map(|words| words.as_deref().map(str::trim));
    let chars = words.flatten().map_or(1, |words| words.chars().count());
    if !(1..=most_chars).contains(&chars) {
        let detail = format!("expected 1 to {most_chars} characters, or null, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    Ok(words)
}

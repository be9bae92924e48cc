//! Label and note with which a team describes a submission for itself.

use crate::{
    error::Result,
    event::{Actor, Event, Subject},
    store::Store,
    tables::submissions::{self, Submission},
};
use faceoff_types::SubmissionId;
use jiff::Timestamp;

/// A team's label and note of a submission: `None` leaves a text unchanged, `Some(None)` removes it.
#[derive(Debug, Clone, Copy, Default)]
pub struct SubmissionDescription<'a> {
    pub label: Option<Option<&'a str>>,
    pub note: Option<Option<&'a str>>,
}

impl Store {
    /// Changes the label and note of a submission; only its team and the organisers can read them.
    pub async fn describe_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        description: SubmissionDescription<'_>,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            if let Some(label) = description.label
                && submission.label.as_deref() != label
            {
                submissions::set_label(tx, id, label).await?;
                let label = label.map(str::to_owned);
                tx.record(Subject::Submission(id), Event::SubmissionLabelled { label });
            }
            if let Some(note) = description.note
                && submission.note.as_deref() != note
            {
                submissions::set_note(tx, id, note).await?;
                tx.record(Subject::Submission(id), Event::SubmissionNoted);
            }
            submissions::find(tx, id).await
        })
        .await
    }
}

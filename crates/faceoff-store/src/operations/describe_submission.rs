use crate::{
    error::Result,
    event::{Actor, Event, Subject},
    store::Store,
    tables::submissions::{self, Submission},
};
use faceoff_types::SubmissionId;
use jiff::Timestamp;

/// What a team says of a submission: `None` leaves it as it is, `Some(None)` takes it away.
#[derive(Debug, Clone, Copy, Default)]
pub struct SubmissionWords<'w> {
    /// What it calls it.
    pub label: Option<Option<&'w str>>,
    /// What it writes about it.
    pub note: Option<Option<&'w str>>,
}

impl Store {
    /// Changes what a team says of a submission, to itself and the organiser.
    pub async fn describe_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        words: SubmissionWords<'_>,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            if let Some(label) = words.label
                && submission.label.as_deref() != label
            {
                submissions::set_label(tx, id, label).await?;
                let label = label.map(str::to_owned);
                tx.record(Subject::Submission(id), Event::SubmissionLabelled { label });
            }
            if let Some(note) = words.note
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

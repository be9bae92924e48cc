use crate::{
    error::Result,
    event::{Actor, Event, Subject},
    operations::purpose,
    queue,
    store::Store,
    tables::{
        season, smoke_runs,
        submissions::{self, Submission},
        teams,
    },
};
use faceoff_types::{BundleRef, SubmissionId, TeamId};
use jiff::Timestamp;

impl Store {
    /// Records an uploaded bundle whose bytes are an artifact already, and queues its smoke run.
    /// [`StoreError::SeasonClosed`](crate::StoreError::SeasonClosed) once the season is over.
    pub async fn create_submission(
        &self,
        actor: Actor,
        team: TeamId,
        bundle: BundleRef,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            teams::find(tx, team).await?;
            let id = SubmissionId::new();
            submissions::insert(tx, id, team, &bundle, now).await?;
            let account = queue::account(tx, purpose::SMOKE.lane, &team.to_string()).await?;
            let unit = queue::insert(tx, purpose::SMOKE, account).await?;
            smoke_runs::insert(tx, id, unit).await?;
            let event = Event::SubmissionUploaded {
                team,
                bundle_blake3: bundle.blake3,
            };
            tx.record(Subject::Submission(id), event);
            submissions::find(tx, id).await
        })
        .await
    }
}

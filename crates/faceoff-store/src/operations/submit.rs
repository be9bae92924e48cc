use crate::{
    boxed,
    error::Result,
    event::{Actor, Event, Subject},
    operations::purpose,
    queue,
    store::Store,
    tables::{
        bundles::{self, UploadQuota, UploadUsage},
        season, smoke_runs,
        submissions::{self, Submission},
        teams,
    },
};
use faceoff_types::{BundleRef, SubmissionId, TeamId};
use jiff::{Timestamp, tz::TimeZone};

/// When the UTC day of an instant began.
fn day_of(now: Timestamp) -> Timestamp {
    let day = now.to_zoned(TimeZone::UTC).start_of_day();
    // UTC has no day without a beginning; the first one of all may have begun before time did.
    day.map_or(Timestamp::MIN, |began| began.timestamp())
}

impl Store {
    /// What a team has used of its quota by `now`.
    #[boxed]
    pub async fn upload_usage(&self, team: TeamId, now: Timestamp) -> Result<UploadUsage> {
        bundles::usage(&mut *self.database.read.acquire().await?, team, day_of(now)).await
    }

    /// Records an uploaded bundle whose bytes are an artifact already, and queues its smoke run.
    /// [`StoreError::Disqualified`](crate::StoreError::Disqualified) if the team is;
    /// [`StoreError::SeasonClosed`](crate::StoreError::SeasonClosed) once the season is over;
    /// [`DayQuotaSpent`](crate::StoreError::DayQuotaSpent) or
    /// [`StoredQuotaSpent`](crate::StoreError::StoredQuotaSpent) beyond the team's quota.
    #[boxed]
    pub async fn create_submission(
        &self,
        actor: Actor,
        team: TeamId,
        bundle: BundleRef,
        quota: &UploadQuota,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            teams::check_may_play(tx, team).await?;
            quota.check(bundles::usage(tx, team, day_of(now)).await?, bundle.bytes)?;
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

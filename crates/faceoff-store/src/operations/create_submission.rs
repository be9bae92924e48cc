//! Upload of a submission: it is added, and its validation run (a check of the bundle) is queued.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::job_purpose,
    queue,
    store::Store,
    tables::{
        bundles::{self, UploadQuota, UploadUsage},
        season,
        submissions::{self, Submission},
        teams, validation_runs,
    },
};
use faceoff_types::{BundleRef, IdempotencyKey, SubmissionId, TeamId};
use jiff::{Timestamp, tz::TimeZone};

/// Beginning of the UTC day of an instant.
fn start_of_utc_day(now: Timestamp) -> Timestamp {
    let day = now.to_zoned(TimeZone::UTC).start_of_day();
    // Fails only for the first representable day, which may begin before the minimum.
    day.map_or(Timestamp::MIN, |start| start.timestamp())
}

impl Store {
    /// A team's use of its upload quota by `now`.
    #[boxed_future]
    pub async fn upload_usage(&self, team: TeamId, now: Timestamp) -> Result<UploadUsage> {
        bundles::usage(
            &mut *self.database.read.acquire().await?,
            team,
            start_of_utc_day(now),
        )
        .await
    }

    /// The team's submission that was uploaded with this key, if there is one.
    #[boxed_future]
    pub async fn uploaded_with_key(
        &self,
        team: TeamId,
        key: &IdempotencyKey,
    ) -> Result<Option<Submission>> {
        let mut connection = self.database.read.acquire().await?;
        submissions::with_idempotency_key(&mut connection, team, key).await
    }

    /// Adds a submission without an idempotency key, as [`create_submission_once`](Self::create_submission_once).
    #[boxed_future]
    pub async fn create_submission(
        &self,
        actor: Actor,
        team: TeamId,
        bundle: BundleRef,
        quota: &UploadQuota,
        now: Timestamp,
    ) -> Result<Submission> {
        self.create_submission_once(actor, team, bundle, None, quota, now)
            .await
    }

    /// Adds a submission whose bundle is stored as an artifact already, and queues its validation run. If the team has uploaded the
    /// same bundle with this `key` before, it returns that submission, whose artifact is another one.
    /// [`StoreError::Disqualified`](crate::StoreError::Disqualified) if the team is disqualified;
    /// [`StoreError::SeasonClosed`](crate::StoreError::SeasonClosed) once the season is over;
    /// [`DailyQuotaExceeded`](crate::StoreError::DailyQuotaExceeded) or
    /// [`StorageQuotaExceeded`](crate::StoreError::StorageQuotaExceeded) beyond the team's quota;
    /// [`IdempotencyKeyUsed`](crate::StoreError::IdempotencyKeyUsed) if another bundle was uploaded with the key.
    #[boxed_future]
    pub async fn create_submission_once(
        &self,
        actor: Actor,
        team: TeamId,
        bundle: BundleRef,
        key: Option<&IdempotencyKey>,
        quota: &UploadQuota,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            if let Some(key) = key
                && let Some(earlier) = submissions::with_idempotency_key(tx, team, key).await?
            {
                if earlier.bundle.blake3 == bundle.blake3 {
                    return Ok(earlier);
                }
                return Err(StoreError::IdempotencyKeyUsed {
                    submission: earlier.id,
                });
            }
            season::check_open(tx).await?;
            teams::check_may_compete(tx, team).await?;
            quota.check(
                bundles::usage(tx, team, start_of_utc_day(now)).await?,
                bundle.bytes,
            )?;
            let id = SubmissionId::new();
            submissions::insert(tx, id, team, &bundle, key, now).await?;
            let account =
                queue::open_account(tx, job_purpose::VALIDATION.lane, &team.to_string()).await?;
            let job = queue::insert(tx, job_purpose::VALIDATION, account).await?;
            validation_runs::insert(tx, id, job).await?;
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

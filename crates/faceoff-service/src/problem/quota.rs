//! Problems of quotas per day, with the time until the quota is available again.

use super::details::Problem;
use faceoff_store::StoreError;
use jiff::{Timestamp, tz::TimeZone};

impl Problem {
    /// The problem of a store error. If a day's quota is used up, `Retry-After` is the time to midnight UTC.
    pub fn with_quota_reset(error: StoreError, now: Timestamp) -> Self {
        let is_daily_quota = matches!(
            error,
            StoreError::DailyQuotaExceeded { .. } | StoreError::GameQuotaExceeded { .. }
        );
        let problem = Self::from(error);
        let tomorrow = now
            .to_zoned(TimeZone::UTC)
            .tomorrow()
            .and_then(|tomorrow| tomorrow.start_of_day());
        match tomorrow {
            Ok(tomorrow) if is_daily_quota => {
                let seconds = tomorrow.timestamp().duration_since(now).as_secs();
                problem.retry_after(seconds.unsigned_abs().max(1))
            }
            _ => problem,
        }
    }
}

use super::details::Problem;
use faceoff_store::StoreError;
use jiff::{Timestamp, tz::TimeZone};

impl Problem {
    /// Of what was asked for within a day's quota: if that is spent, it says when it begins anew, at midnight UTC.
    pub fn of_day(error: StoreError, now: Timestamp) -> Self {
        let is_spent = matches!(
            error,
            StoreError::DayQuotaSpent { .. } | StoreError::FreeGamesSpent { .. }
        );
        let problem = Self::from(error);
        let tomorrow = now
            .to_zoned(TimeZone::UTC)
            .tomorrow()
            .and_then(|tomorrow| tomorrow.start_of_day());
        match tomorrow {
            Ok(tomorrow) if is_spent => {
                let seconds = tomorrow.timestamp().duration_since(now).as_secs();
                problem.retry_after(seconds.unsigned_abs().max(1))
            }
            _ => problem,
        }
    }
}

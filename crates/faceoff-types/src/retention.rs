//! Retention: how long the large files of a stage are kept. A stage is *signed off* when an organiser declares its result
//! final.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The largest value of [`Retention::last`].
pub const MAX_KEPT_EVALUATIONS: u32 = 1000;

/// The largest value of [`Retention::days_after_sign_off`].
pub const MAX_DAYS_AFTER_SIGN_OFF: u32 = 3650;

/// How long a stage's large files are kept: the datasets of its evaluations, and the archives of submissions that
/// are no longer used. Results, boards and the log of events are always kept. Without any field everything is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Retention {
    /// For each team, keep this many of its latest counting evaluations, plus its best under each revision of the
    /// stage's rules; absent: all. 1 to 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<u32>,
    /// Keep files until this instant, or until the stage closes if that is later.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<Timestamp>,
    /// Keep files for this many days after the stage is signed off. 1 to 3650; excludes `until`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub days_after_sign_off: Option<u32>,
}

/// An invalid retention.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidRetention {
    #[error("last: expected 1 to {MAX_KEPT_EVALUATIONS}, got {0}; to keep nothing, set `until`")]
    Last(u32),
    #[error("days_after_sign_off: expected 1 to {MAX_DAYS_AFTER_SIGN_OFF}, got {0}")]
    Days(u32),
    #[error("until and days_after_sign_off: expected one of them at most, got both")]
    UntilAndDays,
}

impl Retention {
    #[must_use]
    pub fn keeps_all(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that all values are in range.
    ///
    /// # Errors
    /// The value that is out of range.
    pub fn check(&self) -> Result<(), InvalidRetention> {
        match (self.last, self.until, self.days_after_sign_off) {
            (Some(last), _, _) if !(1..=MAX_KEPT_EVALUATIONS).contains(&last) => {
                Err(InvalidRetention::Last(last))
            }
            (_, Some(_), Some(_)) => Err(InvalidRetention::UntilAndDays),
            (_, _, Some(days)) if !(1..=MAX_DAYS_AFTER_SIGN_OFF).contains(&days) => {
                Err(InvalidRetention::Days(days))
            }
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Retention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.last {
            Some(last) => write!(f, "the last {last} and the best of each team")?,
            None => f.write_str("all files")?,
        }
        match (self.until, self.days_after_sign_off) {
            (Some(until), _) => write!(f, " until {until}"),
            (None, Some(days)) => write!(f, " until {days} days after the sign-off"),
            (None, None) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retention_round_trips_and_describes_itself() {
        for (json, words) in [
            ("{}", "all files"),
            (r#"{"last":5}"#, "the last 5 and the best of each team"),
            (
                r#"{"until":"2027-01-01T00:00:00Z"}"#,
                "all files until 2027-01-01T00:00:00Z",
            ),
            (
                r#"{"last":1,"days_after_sign_off":30}"#,
                "the last 1 and the best of each team until 30 days after the sign-off",
            ),
        ] {
            let retention: Retention = serde_json::from_str(json).unwrap();
            assert_eq!(retention.check(), Ok(()));
            assert_eq!(serde_json::to_string(&retention).unwrap(), json);
            assert_eq!(retention.to_string(), words);
            assert_eq!(retention.keeps_all(), json == "{}");
        }
    }

    #[test]
    fn retention_out_of_range_is_refused_by_name() {
        for (json, words) in [
            (r#"{"last":0}"#, "last: expected 1 to 1000, got 0"),
            (r#"{"last":1001}"#, "got 1001"),
            (
                r#"{"days_after_sign_off":0}"#,
                "days_after_sign_off: expected 1 to 3650, got 0",
            ),
            (r#"{"days_after_sign_off":4294967295}"#, "got 4294967295"),
            (
                r#"{"until":"2027-01-01T00:00:00Z","days_after_sign_off":3}"#,
                "expected one of them at most",
            ),
        ] {
            let retention: Retention = serde_json::from_str(json).unwrap();
            let error = retention.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        for unreadable in [
            r#"{"last":-1}"#,
            r#"{"last":"five"}"#,
            r#"{"newest":5}"#,
            r#"{"until":"soon"}"#,
            r#""all""#,
        ] {
            assert!(serde_json::from_str::<Retention>(unreadable).is_err());
        }
    }
}

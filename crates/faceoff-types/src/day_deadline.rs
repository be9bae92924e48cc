//! The deadline of an evaluation day, which is all evaluations that start at one *cutoff*: the moment at which each team's
//! active submission is fixed.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// The longest deadline in hours: 31 days.
pub const MAX_DEADLINE_H: u32 = 744;

/// When an evaluation day ends at the latest. Episodes that have not been played by then are never played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum DayDeadline {
    /// The schedule's next cutoff; without a schedule there is no deadline.
    #[default]
    #[serde(rename = "next_cut")]
    NextCutoff,
    /// No deadline.
    Never,
    /// Hours after the cutoff, 1 to 744.
    Hours(u32),
}

impl fmt::Display for DayDeadline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NextCutoff => f.write_str("next-cut"),
            Self::Never => f.write_str("never"),
            Self::Hours(hours) => write!(f, "{hours}h"),
        }
    }
}

/// Text that is not a deadline.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected next-cut, never, or hours as 30h, got {0:?}")]
pub struct ParseDayDeadlineError(String);

impl FromStr for DayDeadline {
    type Err = ParseDayDeadlineError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let hours = || s.strip_suffix('h')?.parse().ok();
        match s {
            "next-cut" => Ok(Self::NextCutoff),
            "never" => Ok(Self::Never),
            _ => hours()
                .map(Self::Hours)
                .ok_or_else(|| ParseDayDeadlineError(s.chars().take(64).collect())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadline_round_trips_and_bad_text_is_refused() {
        for (deadline, json) in [
            (DayDeadline::NextCutoff, r#""next_cut""#),
            (DayDeadline::Never, r#""never""#),
            (DayDeadline::Hours(30), r#"{"hours":30}"#),
        ] {
            assert_eq!(deadline.to_string().parse(), Ok(deadline));
            assert_eq!(serde_json::to_string(&deadline).unwrap(), json);
            assert_eq!(serde_json::from_str::<DayDeadline>(json).unwrap(), deadline);
        }
        for wrong in ["", "30", "h", "-1h", "1.5h", "tomorrow"] {
            let error = wrong.parse::<DayDeadline>().unwrap_err();
            assert!(error.to_string().contains("next-cut"), "{wrong}: {error}");
        }
    }
}

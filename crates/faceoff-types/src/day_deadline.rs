use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// More hours than a day of any stage has: a month.
pub const LONGEST_DEADLINE_H: u32 = 744;

/// Until when what a day's cut has started may be played; what is left then is ended as not played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum DayDeadline {
    /// Until the schedule's next cut; without a schedule there is none.
    #[default]
    NextCut,
    /// However long it takes.
    Never,
    /// So many hours from the cut, 1 to 744.
    Hours(u32),
}

impl fmt::Display for DayDeadline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NextCut => f.write_str("next-cut"),
            Self::Never => f.write_str("never"),
            Self::Hours(hours) => write!(f, "{hours}h"),
        }
    }
}

/// Text that is no deadline.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected next-cut, never, or hours as 30h, got {0:?}")]
pub struct ParseDayDeadlineError(String);

impl FromStr for DayDeadline {
    type Err = ParseDayDeadlineError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let hours = || s.strip_suffix('h')?.parse().ok();
        match s {
            "next-cut" => Ok(Self::NextCut),
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
    fn deadlines_read_back_and_others_are_told_what_one_is() {
        for (deadline, json) in [
            (DayDeadline::NextCut, r#""next_cut""#),
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

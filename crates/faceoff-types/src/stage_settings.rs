//! Settings of a stage: when its days start and end, which results count, and what is public.

use crate::{
    DayDeadline, MAX_DEADLINE_H, MAX_EPISODES_PER_TASK, Schedule, StageUploadLimits,
    invalid_stage_rules::{InvalidStageRules, MAX_MEAN_DAYS},
};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Settings of a stage that do not affect scores.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default)]
pub struct StageSettings {
    /// Start times of its days; null: the organisers start each day.
    pub schedule: Option<Schedule>,
    /// Episodes per task and profile of the ablation that the schedule creates for every submission it evaluates;
    /// 0: no ablations.
    pub ablation_episodes: u32,
    /// Episodes per shard, the part of a task that one job plays; at least 1.
    pub episodes_per_shard: u32,
    /// When its days end.
    pub day_deadline: DayDeadline,
    /// Are scores visible only to organisers, until they reveal them?
    pub blind: bool,
    /// When its datasets become public.
    pub publishes: Publication,
    /// Which result of a team counts on the board.
    #[serde(rename = "standings")]
    pub counting_result: CountingResult,
    /// Upload quotas that differ from the server's configuration; absent if none do.
    #[serde(skip_serializing_if = "StageUploadLimits::is_none")]
    pub uploads: StageUploadLimits,
}

impl Default for StageSettings {
    fn default() -> Self {
        Self {
            schedule: None,
            ablation_episodes: 0,
            episodes_per_shard: 50,
            day_deadline: DayDeadline::NextCutoff,
            blind: false,
            publishes: Publication::AtClose,
            counting_result: CountingResult::Latest,
            uploads: StageUploadLimits::default(),
        }
    }
}

impl StageSettings {
    /// Checks that all settings are in range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), InvalidStageRules> {
        if !(1..=MAX_EPISODES_PER_TASK).contains(&self.episodes_per_shard) {
            return Err(InvalidStageRules::Shards(self.episodes_per_shard));
        }
        if self.ablation_episodes > MAX_EPISODES_PER_TASK {
            return Err(InvalidStageRules::Ablations(self.ablation_episodes));
        }
        if let DayDeadline::Hours(hours) = self.day_deadline
            && !(1..=MAX_DEADLINE_H).contains(&hours)
        {
            return Err(InvalidStageRules::Deadline(hours));
        }
        self.uploads.check().map_err(InvalidStageRules::Uploads)?;
        match self.counting_result {
            CountingResult::MeanOfLast(days) if !(1..=MAX_MEAN_DAYS).contains(&days) => {
                Err(InvalidStageRules::MeanDays(days))
            }
            _ => Ok(()),
        }
    }
}

/// When the datasets of a stage's released days become public, i.e. need no token. A team may publish its own
/// earlier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Publication {
    /// Never automatically.
    Never,
    /// When the stage, or the season, has closed.
    AtClose,
    /// When the day is released.
    AtRelease,
}

impl Publication {
    /// All values, from the most restrictive on.
    pub const ALL: [Self; 3] = [Self::Never, Self::AtClose, Self::AtRelease];

    /// The name in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Never => "never",
            Self::AtClose => "at_close",
            Self::AtRelease => "at_release",
        }
    }
}

/// Which of a team's finished evaluations under the board's rules count on the board of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum CountingResult {
    /// The latest evaluation.
    Latest,
    /// The evaluation that ranks highest.
    Best,
    /// The mean of this many latest evaluations.
    MeanOfLast(u32),
    /// The evaluation of the final day, which the organisers start once after the stage closes.
    Final,
}

/// Text that is not a valid value of a setting.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, got {got:?}")]
pub struct UnknownSetting {
    expected: &'static str,
    got: String,
}

impl FromStr for Publication {
    type Err = UnknownSetting;
    fn from_str(text: &str) -> Result<Self, UnknownSetting> {
        Self::ALL
            .into_iter()
            .find(|publication| publication.as_str() == text)
            .ok_or_else(|| UnknownSetting {
                expected: "never, at_close or at_release",
                got: text.to_owned(),
            })
    }
}

impl fmt::Display for Publication {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

const MEAN_PREFIX: &str = "mean_of_last:";

/// The form used on the command line; a mean is `mean_of_last:5`.
impl FromStr for CountingResult {
    type Err = UnknownSetting;
    fn from_str(text: &str) -> Result<Self, UnknownSetting> {
        let days = text
            .strip_prefix(MEAN_PREFIX)
            .and_then(|days| days.parse().ok());
        match (text, days) {
            ("latest", _) => Ok(Self::Latest),
            ("best", _) => Ok(Self::Best),
            ("final", _) => Ok(Self::Final),
            (_, Some(days)) => Ok(Self::MeanOfLast(days)),
            _ => Err(UnknownSetting {
                expected: "latest, best, final, or mean_of_last:N as mean_of_last:5",
                got: text.to_owned(),
            }),
        }
    }
}

impl fmt::Display for CountingResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Latest => f.pad("latest"),
            Self::Best => f.pad("best"),
            Self::MeanOfLast(days) => write!(f, "{MEAN_PREFIX}{days}"),
            Self::Final => f.pad("final"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_defaults_and_bounds() {
        let settings: StageSettings = serde_json::from_str("{}").unwrap();
        assert_eq!(settings, StageSettings::default());
        assert_eq!(settings.check(), Ok(()));
        let no_episodes = StageSettings {
            episodes_per_shard: 0,
            ..settings.clone()
        };
        assert_eq!(no_episodes.check(), Err(InvalidStageRules::Shards(0)));
        let too_many = StageSettings {
            ablation_episodes: u32::MAX,
            ..settings.clone()
        };
        assert_eq!(
            too_many.check(),
            Err(InvalidStageRules::Ablations(u32::MAX))
        );
        for hours in [0, MAX_DEADLINE_H + 1] {
            let wrong = StageSettings {
                day_deadline: DayDeadline::Hours(hours),
                ..settings.clone()
            };
            assert_eq!(wrong.check(), Err(InvalidStageRules::Deadline(hours)));
        }
        for days in [0, MAX_MEAN_DAYS + 1] {
            let mean = StageSettings {
                counting_result: CountingResult::MeanOfLast(days),
                ..settings.clone()
            };
            assert_eq!(mean.check(), Err(InvalidStageRules::MeanDays(days)));
        }
    }

    #[test]
    fn settings_round_trip_in_json_and_text() {
        for (counting_result, json, words) in [
            (CountingResult::Latest, r#""latest""#, "latest"),
            (CountingResult::Best, r#""best""#, "best"),
            (
                CountingResult::MeanOfLast(5),
                r#"{"mean_of_last":5}"#,
                "mean_of_last:5",
            ),
            (CountingResult::Final, r#""final""#, "final"),
        ] {
            assert_eq!(serde_json::to_string(&counting_result).unwrap(), json);
            assert_eq!(
                serde_json::from_str::<CountingResult>(json).unwrap(),
                counting_result
            );
            assert_eq!(counting_result.to_string(), words);
            assert_eq!(words.parse(), Ok(counting_result));
        }
        for publishes in Publication::ALL {
            let json = format!("{:?}", publishes.as_str());
            assert_eq!(serde_json::to_string(&publishes).unwrap(), json);
            assert_eq!(publishes.to_string().parse(), Ok(publishes));
        }
        for wrong in ["mean_of_last", "mean_of_last:", "mean_of_last:x", "newest"] {
            let error = wrong.parse::<CountingResult>().unwrap_err().to_string();
            assert!(error.contains("mean_of_last:5"), "{error}");
        }
        assert!("soon".parse::<Publication>().is_err());
    }
}

use crate::{
    DayDeadline, LONGEST_DEADLINE_H, MAX_EPISODES_PER_TASK, Schedule, StageUploads,
    stage_bounds::{InvalidStageRules, MAX_MEAN_DAYS},
};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// How a stage goes on, without a score depending on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default)]
pub struct StageSettings {
    /// When its days start; null: when the organiser starts them.
    pub schedule: Option<Schedule>,
    /// Episodes of each task and profile of the ablation that the schedule orders of every submission that it
    /// starts; 0: none.
    pub ablation_episodes: u32,
    /// Episodes of one unit of work; at least one.
    pub episodes_per_shard: u32,
    /// Until when what its cut has started may be played.
    pub day_deadline: DayDeadline,
    /// Are its scores hidden from everybody but the organiser?
    pub blind: bool,
    /// When its datasets are there for everybody.
    pub publishes: Publishes,
    /// What a team's row on its board is made of.
    pub standings: Standings,
    /// What each team may upload meanwhile; absent if all is the server's.
    #[serde(skip_serializing_if = "StageUploads::is_none")]
    pub uploads: StageUploads,
}

impl Default for StageSettings {
    fn default() -> Self {
        Self {
            schedule: None,
            ablation_episodes: 0,
            episodes_per_shard: 50,
            day_deadline: DayDeadline::NextCut,
            blind: false,
            publishes: Publishes::AtClose,
            standings: Standings::Latest,
            uploads: StageUploads::default(),
        }
    }
}

impl StageSettings {
    /// Can a stage go on so?
    ///
    /// # Errors
    /// What is out of bounds.
    pub fn check(&self) -> Result<(), InvalidStageRules> {
        if !(1..=MAX_EPISODES_PER_TASK).contains(&self.episodes_per_shard) {
            return Err(InvalidStageRules::Shards(self.episodes_per_shard));
        }
        if self.ablation_episodes > MAX_EPISODES_PER_TASK {
            return Err(InvalidStageRules::Ablations(self.ablation_episodes));
        }
        if let DayDeadline::Hours(hours) = self.day_deadline
            && !(1..=LONGEST_DEADLINE_H).contains(&hours)
        {
            return Err(InvalidStageRules::Deadline(hours));
        }
        self.uploads.check().map_err(InvalidStageRules::Uploads)?;
        match self.standings {
            Standings::MeanOfLast(days) if !(1..=MAX_MEAN_DAYS).contains(&days) => {
                Err(InvalidStageRules::MeanDays(days))
            }
            _ => Ok(()),
        }
    }
}

/// When the datasets of a stage's released days are there for everybody, without a token. A team may publish its own
/// earlier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Publishes {
    /// By the stage never.
    Never,
    /// When the stage, or the season, has closed.
    AtClose,
    /// When the day is released.
    AtRelease,
}

impl Publishes {
    /// All, the most reserved first.
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

/// What a team's row on a stage's board is made of: of its finished evaluations by the board's rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Standings {
    /// The newest.
    Latest,
    /// The one that stands highest by the board's order.
    Best,
    /// The mean of the last so many.
    MeanOfLast(u32),
    /// That of the final day, which the organiser starts once after the close.
    Final,
}

/// Text that is none of them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, got {got:?}")]
pub struct UnknownSetting {
    expected: &'static str,
    got: String,
}

impl FromStr for Publishes {
    type Err = UnknownSetting;
    fn from_str(text: &str) -> Result<Self, UnknownSetting> {
        Self::ALL
            .into_iter()
            .find(|one| one.as_str() == text)
            .ok_or_else(|| UnknownSetting {
                expected: "never, at_close or at_release",
                got: text.to_owned(),
            })
    }
}

impl fmt::Display for Publishes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

const MEAN: &str = "mean_of_last:";

/// As the command line takes it: a mean is `mean_of_last:5`.
impl FromStr for Standings {
    type Err = UnknownSetting;
    fn from_str(text: &str) -> Result<Self, UnknownSetting> {
        let days = text.strip_prefix(MEAN).and_then(|days| days.parse().ok());
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

impl fmt::Display for Standings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Latest => f.pad("latest"),
            Self::Best => f.pad("best"),
            Self::MeanOfLast(days) => write!(f, "{MEAN}{days}"),
            Self::Final => f.pad("final"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_bounded_and_may_be_left_out() {
        let settings: StageSettings = serde_json::from_str("{}").unwrap();
        assert_eq!(settings, StageSettings::default());
        assert_eq!(settings.check(), Ok(()));
        let none = StageSettings {
            episodes_per_shard: 0,
            ..settings.clone()
        };
        assert_eq!(none.check(), Err(InvalidStageRules::Shards(0)));
        let many = StageSettings {
            ablation_episodes: u32::MAX,
            ..settings.clone()
        };
        assert_eq!(many.check(), Err(InvalidStageRules::Ablations(u32::MAX)));
        for hours in [0, LONGEST_DEADLINE_H + 1] {
            let none = StageSettings {
                day_deadline: DayDeadline::Hours(hours),
                ..settings.clone()
            };
            assert_eq!(none.check(), Err(InvalidStageRules::Deadline(hours)));
        }
        for days in [0, MAX_MEAN_DAYS + 1] {
            let mean = StageSettings {
                standings: Standings::MeanOfLast(days),
                ..settings.clone()
            };
            assert_eq!(mean.check(), Err(InvalidStageRules::MeanDays(days)));
        }
    }

    #[test]
    fn standings_and_publication_read_back_from_json_and_from_words() {
        for (standings, json, words) in [
            (Standings::Latest, r#""latest""#, "latest"),
            (Standings::Best, r#""best""#, "best"),
            (
                Standings::MeanOfLast(5),
                r#"{"mean_of_last":5}"#,
                "mean_of_last:5",
            ),
            (Standings::Final, r#""final""#, "final"),
        ] {
            assert_eq!(serde_json::to_string(&standings).unwrap(), json);
            assert_eq!(serde_json::from_str::<Standings>(json).unwrap(), standings);
            assert_eq!(standings.to_string(), words);
            assert_eq!(words.parse(), Ok(standings));
        }
        for publishes in Publishes::ALL {
            let json = format!("{:?}", publishes.as_str());
            assert_eq!(serde_json::to_string(&publishes).unwrap(), json);
            assert_eq!(publishes.to_string().parse(), Ok(publishes));
        }
        for wrong in ["mean_of_last", "mean_of_last:", "mean_of_last:x", "newest"] {
            let error = wrong.parse::<Standings>().unwrap_err().to_string();
            assert!(error.contains("mean_of_last:5"), "{error}");
        }
        assert!("soon".parse::<Publishes>().is_err());
    }
}

use crate::{
    MAX_EPISODES_PER_TASK, Profile, Ruleset, Runtimes, StageId, StageLimits, Task, Variation,
    stage_bounds::InvalidStageRules,
};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A day of a stage. Its text is the stage's id, a slash and the ISO date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageDay {
    pub stage: StageId,
    /// In the stage's zone, of the day's cut.
    pub date: Date,
}

impl fmt::Display for StageDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.stage, self.date)
    }
}

/// Text that is no day of a stage.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not a day of a stage: expected the stage's id, a slash and the date as YYYY-MM-DD")]
pub struct ParseStageDayError;

impl FromStr for StageDay {
    type Err = ParseStageDayError;
    fn from_str(s: &str) -> Result<Self, ParseStageDayError> {
        let (stage, date) = s.split_once('/').ok_or(ParseStageDayError)?;
        Ok(Self {
            stage: stage.parse().map_err(|_| ParseStageDayError)?,
            date: date.parse().map_err(|_| ParseStageDayError)?,
        })
    }
}

/// What scores of a stage depend on. Rows of different rules never stand on one board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct StageRules {
    /// The simulator and the scoring.
    #[cfg_attr(feature = "openapi", schema(value_type = String, example = "airhockey-2023.3"))]
    pub ruleset: Ruleset,
    /// The perturbations.
    pub profile: Profile,
    /// In the order of play; at least one, none twice.
    pub tasks: Vec<Task>,
    /// Episodes of each task that a team plays on a day.
    pub episodes_per_task: u32,
    /// More agent faults than this end an evaluation without a score.
    pub max_faults: u32,
    /// Weights, bounds of the tiers and magnitudes, as far as they are not the ruleset's.
    #[serde(flatten)]
    pub variation: Variation,
    /// What agents are held to otherwise than by the server's configuration; absent if all is the server's.
    #[serde(default, skip_serializing_if = "StageLimits::is_none")]
    pub limits: Box<StageLimits>,
    /// The runtimes that its agents may use; absent: all that the server offers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtimes: Option<Runtimes>,
}

impl StageRules {
    /// Can anything be played by them?
    ///
    /// # Errors
    /// What cannot be.
    pub fn check(&self) -> Result<(), InvalidStageRules> {
        let twice = |task: &Task| self.tasks.iter().filter(|other| *other == task).count() > 1;
        if self.tasks.is_empty() || self.tasks.iter().any(twice) {
            return Err(InvalidStageRules::Tasks);
        }
        if !(1..=MAX_EPISODES_PER_TASK).contains(&self.episodes_per_task) {
            return Err(InvalidStageRules::Episodes(self.episodes_per_task));
        }
        self.variation.perturbations.check()?;
        if let Some(runtimes) = &self.runtimes {
            runtimes.check()?;
        }
        self.limits.check().map_err(InvalidStageRules::Limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_play_each_task_once_and_some_episodes() {
        let rules = |tasks: &[Task], episodes_per_task| StageRules {
            runtimes: None,
            ruleset: Ruleset::CURRENT,
            profile: Profile::Evaluation,
            tasks: tasks.to_vec(),
            episodes_per_task,
            max_faults: 3,
            variation: Variation::default(),
            limits: Default::default(),
        };
        assert_eq!(rules(&Task::ALL, 1).check(), Ok(()));
        assert_eq!(rules(&[], 1).check(), Err(InvalidStageRules::Tasks));
        let twice = [Task::Hit, Task::Hit];
        assert_eq!(rules(&twice, 1).check(), Err(InvalidStageRules::Tasks));
        for episodes in [0, MAX_EPISODES_PER_TASK + 1] {
            let refused = rules(&Task::ALL, episodes).check();
            assert_eq!(refused, Err(InvalidStageRules::Episodes(episodes)));
        }
    }

    #[test]
    fn rules_of_before_there_were_variations_are_read_and_written_as_they_were() {
        let text = r#"{"ruleset":"airhockey-2023.2","profile":"evaluation","tasks":["hit"],"episodes_per_task":4,"max_faults":1}"#;
        let rules: StageRules = serde_json::from_str(text).unwrap();
        assert!(rules.variation.is_none());
        assert_eq!(serde_json::to_string(&rules).unwrap(), text);
        let mut wild = rules;
        wild.variation.perturbations.tracking_loss.probability = 2.0;
        let refused = wild.check().unwrap_err();
        assert_eq!(refused.field(), "perturbations");
        assert!(
            refused.to_string().contains("tracking_loss.probability"),
            "{refused}"
        );
    }
}

//! A stage is a part of a season with its own rules, evaluation days and board (table of results). This module has its
//! rules, and [`StageDay`], which identifies one of its days.

use crate::{
    MAX_EPISODES_PER_TASK, Profile, Ruleset, Runtimes, StageId, StageLimits, Task, Variation,
    invalid_stage_rules::InvalidStageRules,
};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A day of a stage. Its text is the stage's id, a slash and the ISO date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageDay {
    pub stage: StageId,
    /// Date of the day's cutoff in the stage's zone.
    pub date: Date,
}

impl fmt::Display for StageDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.stage, self.date)
    }
}

/// Text that is not a day of a stage.
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

/// The rules on which the scores of a stage depend. Results under different rules are never on the same board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct StageRules {
    /// Version of the simulator and of the scoring.
    #[cfg_attr(feature = "openapi", schema(value_type = String, example = "airhockey-2023.3"))]
    pub ruleset: Ruleset,
    /// Perturbation profile.
    pub profile: Profile,
    /// Tasks in the order of play; at least one, without repetition.
    pub tasks: Vec<Task>,
    /// Episodes per task and evaluation day.
    pub episodes_per_task: u32,
    /// Agent faults allowed; one more ends an evaluation without a score.
    pub max_faults: u32,
    /// Task weights, tier bounds and perturbation magnitudes that differ from the competition's.
    #[serde(flatten)]
    pub variation: Variation,
    /// Limits of agents that differ from the server's configuration; absent if none do.
    #[serde(default, skip_serializing_if = "StageLimits::is_empty")]
    pub limits: Box<StageLimits>,
    /// Runtimes that agents may use; absent: all that the server offers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtimes: Option<Runtimes>,
}

impl StageRules {
    /// Checks that evaluations are possible under these rules.
    ///
    /// # Errors
    /// The first invalid field.
    pub fn check(&self) -> Result<(), InvalidStageRules> {
        let is_repeated =
            |task: &Task| self.tasks.iter().filter(|other| *other == task).count() > 1;
        if self.tasks.is_empty() || self.tasks.iter().any(is_repeated) {
            return Err(InvalidStageRules::Tasks);
        }
        if !(1..=MAX_EPISODES_PER_TASK).contains(&self.episodes_per_task) {
            return Err(InvalidStageRules::Episodes(self.episodes_per_task));
        }
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
    fn rules_need_distinct_tasks_and_episodes() {
        let [hit, defend] = ["hit", "defend"].map(Task::new);
        let rules = |tasks: &[Task], episodes_per_task| StageRules {
            runtimes: None,
            ruleset: Ruleset::new("airhockey-2023.3"),
            profile: Profile::new("evaluation"),
            tasks: tasks.to_vec(),
            episodes_per_task,
            max_faults: 3,
            variation: Variation::default(),
            limits: Default::default(),
        };
        assert_eq!(rules(&[hit, defend], 1).check(), Ok(()));
        assert_eq!(rules(&[], 1).check(), Err(InvalidStageRules::Tasks));
        let twice = [hit, hit];
        assert_eq!(rules(&twice, 1).check(), Err(InvalidStageRules::Tasks));
        for episodes in [0, MAX_EPISODES_PER_TASK + 1] {
            let refused = rules(&[hit, defend], episodes).check();
            assert_eq!(refused, Err(InvalidStageRules::Episodes(episodes)));
        }
    }

    #[test]
    fn rules_without_variation_round_trip_unchanged() {
        let text = r#"{"ruleset":"airhockey-2023.2","profile":"evaluation","tasks":["hit"],"episodes_per_task":4,"max_faults":1}"#;
        let rules: StageRules = serde_json::from_str(text).unwrap();
        assert!(rules.variation.is_empty());
        assert_eq!(serde_json::to_string(&rules).unwrap(), text);
    }
}

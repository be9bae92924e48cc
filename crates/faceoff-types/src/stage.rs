use crate::{
    DayDeadline, LONGEST_DEADLINE_H, MAX_EPISODES_PER_TASK, Profile, Ruleset, Schedule, StageId,
    Task,
};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A day of a stage. Its text is the stage's id, a slash and the ISO date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageDay {
    /// Whose.
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct StageRules {
    /// The simulator and the scoring.
    #[cfg_attr(feature = "openapi", schema(value_type = String, example = "airhockey-2023.2"))]
    pub ruleset: Ruleset,
    /// The perturbations.
    pub profile: Profile,
    /// In the order of play; at least one, none twice.
    pub tasks: Vec<Task>,
    /// Episodes of each task that a team plays on a day.
    pub episodes_per_task: u32,
    /// More agent faults than this end an evaluation without a score.
    pub max_faults: u32,
}

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
}

impl Default for StageSettings {
    fn default() -> Self {
        Self {
            schedule: None,
            ablation_episodes: 0,
            episodes_per_shard: 50,
            day_deadline: DayDeadline::NextCut,
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
        Ok(())
    }
}

/// Rules or settings by which nothing could be played.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidStageRules {
    /// No task, or one twice.
    #[error("tasks: each task at most once, and at least one")]
    Tasks,
    /// None, or more than are ever played.
    #[error("episodes_per_task: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Episodes(u32),
    /// None, or more than are ever played.
    #[error("episodes_per_shard: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Shards(u32),
    /// More than are ever played.
    #[error("ablation_episodes: expected at most {MAX_EPISODES_PER_TASK}, got {0}")]
    Ablations(u32),
    /// A day without time, or with more than any has.
    #[error("day_deadline: expected 1 to {LONGEST_DEADLINE_H} hours, got {0}")]
    Deadline(u32),
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
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_play_each_task_once_and_some_episodes() {
        let rules = |tasks: &[Task], episodes_per_task| StageRules {
            ruleset: Ruleset::CURRENT,
            profile: Profile::Evaluation,
            tasks: tasks.to_vec(),
            episodes_per_task,
            max_faults: 3,
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
    fn settings_are_bounded_and_may_be_left_out() {
        let settings: StageSettings = serde_json::from_str("{}").unwrap();
        assert_eq!(settings, StageSettings::default());
        assert_eq!(settings.check(), Ok(()));
        let none = StageSettings {
            episodes_per_shard: 0,
            ..settings.clone()
        };
        assert_eq!(none.check(), Err(InvalidStageRules::Shards(0)));
        for hours in [0, LONGEST_DEADLINE_H + 1] {
            let none = StageSettings {
                day_deadline: DayDeadline::Hours(hours),
                ..settings.clone()
            };
            assert_eq!(none.check(), Err(InvalidStageRules::Deadline(hours)));
        }
        let many = StageSettings {
            ablation_episodes: u32::MAX,
            ..settings
        };
        assert_eq!(many.check(), Err(InvalidStageRules::Ablations(u32::MAX)));
    }
}

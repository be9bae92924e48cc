//! The board of the qualifying stage from a file of published results, `tasks.json`, without the episodes themselves.

use crate::{
    board::BoardKey, evaluation::overall_score, interval::wilson95_of_rate, tier::tier_with_bounds,
    tournament::MAX_EPISODE_PENALTY, unique_map::UniqueMap,
};
use faceoff_types::{Task, TaskMap, TaskWeights, TeamName, Tier, TierBounds, UnknownTask};
use serde::{
    Deserialize, Serialize,
    de::{Deserializer, IgnoredAny},
};

/// Episodes of each task in the qualifying stage (paper on the 2023 Robot Air Hockey Challenge, §2.2).
pub const QUALIFYING_EPISODES: u32 = 1000;

/// A team's published results in one task: the numbers that a board needs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "RawTaskScore")]
pub struct TaskScore {
    success_rate: f64,
    penalty_points: f64,
    episodes: u32,
}

/// A task's entry in the file, not validated. The other fields that `results.json`, the result of an evaluation, has for a task are allowed
/// and ignored, so that its `tasks` can be copied unchanged.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTaskScore {
    success_rate: f64,
    penalty_points: f64,
    #[serde(default = "qualifying_episodes")]
    episodes: u32,
    #[serde(default, rename = "successes")]
    _successes: IgnoredAny,
    #[serde(default, rename = "success_ci95")]
    _success_ci95: IgnoredAny,
    #[serde(default, rename = "violations")]
    _violations: IgnoredAny,
    #[serde(default, rename = "tier")]
    _tier: IgnoredAny,
    #[serde(default, rename = "steps")]
    _steps: IgnoredAny,
    #[serde(default, rename = "computation_time_s")]
    _computation_time_s: IgnoredAny,
}

const fn qualifying_episodes() -> u32 {
    QUALIFYING_EPISODES
}

/// Why a task's results are invalid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InvalidTaskScore {
    /// The success rate is not a fraction.
    #[error(
        "success_rate: expected a fraction from 0 to 1, got {0}{hint}",
        hint = if *.0 > 1.0 && *.0 <= 100.0 { " (divide percentages by 100)" } else { "" }
    )]
    SuccessRate(f64),
    /// The number of episodes is 0.
    #[error("episodes: expected at least 1, got 0")]
    NoEpisodes,
    /// The penalty points are impossible under the rules.
    #[error(
        "penalty_points: expected 0 to {maximum} ({MAX_EPISODE_PENALTY} for each of {episodes} episodes), got {points}",
        maximum = MAX_EPISODE_PENALTY * f64::from(*.episodes)
    )]
    PenaltyPoints {
        /// Penalty points in the file.
        points: f64,
        /// Number of episodes that they are the sum of.
        episodes: u32,
    },
}

impl TaskScore {
    /// A task's score from its success rate (a fraction), penalty points and number of episodes.
    ///
    /// # Errors
    /// If a number is not finite or impossible under the rules.
    pub fn new(
        success_rate: f64,
        penalty_points: f64,
        episodes: u32,
    ) -> Result<Self, InvalidTaskScore> {
        if !(0.0..=1.0).contains(&success_rate) {
            return Err(InvalidTaskScore::SuccessRate(success_rate));
        }
        if episodes == 0 {
            return Err(InvalidTaskScore::NoEpisodes);
        }
        if !(0.0..=MAX_EPISODE_PENALTY * f64::from(episodes)).contains(&penalty_points) {
            return Err(InvalidTaskScore::PenaltyPoints {
                points: penalty_points,
                episodes,
            });
        }
        // −0 is valid, but would be serialised with its sign.
        Ok(Self {
            success_rate: success_rate + 0.0,
            penalty_points: penalty_points + 0.0,
            episodes,
        })
    }

    fn tier(&self, bounds: Option<TierBounds>) -> Option<Tier> {
        let bounds = bounds?;
        Some(tier_with_bounds(
            &bounds,
            self.penalty_points,
            self.episodes,
        ))
    }
}

impl TryFrom<RawTaskScore> for TaskScore {
    type Error = InvalidTaskScore;
    fn try_from(raw: RawTaskScore) -> Result<Self, InvalidTaskScore> {
        Self::new(raw.success_rate, raw.penalty_points, raw.episodes)
    }
}

/// `tasks.json`: the results of each team in the tasks of the competition, in the sequence of the file.
///
/// Deserialisation rejects duplicate teams and tasks, unknown fields, and numbers that are
/// impossible under the rules.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QualifyingScores {
    teams: Vec<(TeamName, TaskScores)>,
}

#[derive(Debug, Clone, PartialEq)]
struct TaskScores(TaskMap<TaskScore>);

impl<'de> Deserialize<'de> for TaskScores {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let scores = UniqueMap::deserialize(deserializer)?.0;
        Ok(Self(scores.into_iter().collect()))
    }
}

/// A team whose tasks are not those of the competition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTasks {
    /// A task that the competition does not have.
    #[error("{team}: {unknown}")]
    Unknown {
        /// The team in the file.
        team: TeamName,
        /// The task, and those of the competition.
        unknown: UnknownTask,
    },
    /// A task without results.
    #[error("{team}: task {task} is missing")]
    Missing {
        /// The team in the file.
        team: TeamName,
        /// The missing task.
        task: Task,
    },
}

impl<'de> Deserialize<'de> for QualifyingScores {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self {
            teams: UniqueMap::deserialize(deserializer)?.0,
        })
    }
}

/// One row of the qualifying board; field names as in `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QualifyingRow {
    /// From 1 over the whole board, across tiers.
    pub rank: u32,
    /// Name in the input file.
    pub team: TeamName,
    /// Overall tier: the worst over the tasks; absent in a competition without tiers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tier: Option<Tier>,
    /// Overall score in percent.
    pub score: f64,
    /// Overall deployability score (DS): the maximum over the tasks.
    pub penalty_points: f64,
    /// Results of the tasks.
    pub tasks: TaskMap<TaskRow>,
}

/// One task of a [`QualifyingRow`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TaskRow {
    /// Rank on the board of this task, from 1.
    pub rank: u32,
    /// Tier that follows from the penalty points; absent in a competition without tiers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tier: Option<Tier>,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    pub success_ci95: [f64; 2],
    /// The deployability score (DS) of the task.
    pub penalty_points: f64,
    /// Number of episodes.
    pub episodes: u32,
}

impl QualifyingScores {
    /// The board, best first, ranked as [`overall_board`](crate::overall_board). The position in the file replaces the time of
    /// submission. There is a weight for each task of the competition; `bounds` decide the tiers, if it has tiers.
    ///
    /// # Errors
    /// The first team with a task that the competition does not have, or without one of its tasks.
    pub fn board(
        &self,
        weights: &TaskWeights,
        bounds: Option<TierBounds>,
    ) -> Result<Vec<QualifyingRow>, InvalidTasks> {
        let tasks: Vec<Task> = weights.tasks().collect();
        for (team, scores) in &self.teams {
            scores.check(team, &tasks)?;
        }
        let ranks_of_task = |task: &Task| {
            self.ranks(|scores| {
                let score = scores.0[task];
                (score.tier(bounds), score.success_rate, score.penalty_points)
            })
        };
        let task_ranks: Vec<Vec<u32>> = tasks.iter().map(ranks_of_task).collect();
        let ranks = self.ranks(|scores| {
            (
                scores.tier(bounds),
                scores.score(weights),
                scores.penalty_points(),
            )
        });
        let mut rows: Vec<_> = (0..)
            .zip(&self.teams)
            .map(|(index, (team, scores))| QualifyingRow {
                rank: ranks[index],
                team: team.clone(),
                tier: scores.tier(bounds),
                score: scores.score(weights),
                penalty_points: scores.penalty_points(),
                tasks: tasks
                    .iter()
                    .zip(&task_ranks)
                    .map(|(task, ranks)| (*task, scores.0[task].row(ranks[index], bounds)))
                    .collect(),
            })
            .collect();
        rows.sort_by_key(|row| row.rank);
        Ok(rows)
    }

    /// The rank of each team, in the sequence of the file.
    fn ranks(&self, key: impl Fn(&TaskScores) -> (Option<Tier>, f64, f64)) -> Vec<u32> {
        let mut keyed: Vec<(usize, BoardKey)> = (0..)
            .zip(&self.teams)
            .map(|(index, (_, scores))| {
                let (tier, score, penalty_points) = key(scores);
                (index, BoardKey::new(tier, score, penalty_points, 0))
            })
            .collect();
        keyed.sort_by(|(_, a), (_, b)| a.compare(b));
        let mut ranks = vec![0; keyed.len()];
        for (rank, (index, _)) in (1..).zip(keyed) {
            ranks[index] = rank;
        }
        ranks
    }
}

impl TaskScores {
    /// Checks that there is a score for each of `tasks`, and for no other.
    fn check(&self, team: &TeamName, tasks: &[Task]) -> Result<(), InvalidTasks> {
        let team = || team.clone();
        if let Some(unknown) = self.0.keys().find(|task| !tasks.contains(task)) {
            let unknown = UnknownTask::new(unknown.as_str(), tasks.iter().copied());
            return Err(InvalidTasks::Unknown {
                team: team(),
                unknown,
            });
        }
        match tasks.iter().find(|task| !self.0.contains_key(*task)) {
            Some(task) => Err(InvalidTasks::Missing {
                team: team(),
                task: *task,
            }),
            None => Ok(()),
        }
    }

    fn tier(&self, bounds: Option<TierBounds>) -> Option<Tier> {
        self.0.values().filter_map(|score| score.tier(bounds)).max()
    }

    fn score(&self, weights: &TaskWeights) -> f64 {
        overall_score(
            weights,
            self.0
                .iter()
                .map(|(task, score)| (*task, score.success_rate)),
        )
    }

    fn penalty_points(&self) -> f64 {
        self.0
            .values()
            .map(|score| score.penalty_points)
            .fold(0.0, f64::max)
    }
}

impl TaskScore {
    fn row(&self, rank: u32, bounds: Option<TierBounds>) -> TaskRow {
        TaskRow {
            rank,
            tier: self.tier(bounds),
            success_rate: self.success_rate,
            success_ci95: wilson95_of_rate(self.success_rate, self.episodes),
            penalty_points: self.penalty_points,
            episodes: self.episodes,
        }
    }
}

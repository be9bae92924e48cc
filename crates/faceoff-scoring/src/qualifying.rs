use crate::{
    board::Placing, episode::MAX_EPISODE_PENALTY, evaluation::overall_score,
    interval::wilson95_of_rate, tier::tier_within, unique_map::UniqueMap,
};
use faceoff_types::{Task, TaskWeights, TeamName, Tier, TierBounds};
use serde::{
    Deserialize, Serialize,
    de::{Deserializer, Error, IgnoredAny},
};
use std::collections::BTreeMap;

/// Episodes of each task in the qualifying stage (paper §2.2).
pub const QUALIFYING_EPISODES: u32 = 1000;

/// A team's published numbers of one task, the least that a board needs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "RawTaskScore")]
pub struct TaskScore {
    success_rate: f64,
    penalty_points: f64,
    episodes: u32,
}

/// The field of a file as it is written; the fields of `results.json` that follow from others may
/// stand there, so that its `tasks` can be used as they are.
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

/// Why numbers are no task's score.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InvalidTaskScore {
    /// Not a fraction.
    #[error(
        "success_rate: expected a fraction from 0 to 1, got {0}{hint}",
        hint = if *.0 > 1.0 && *.0 <= 100.0 { " (divide percentages by 100)" } else { "" }
    )]
    SuccessRate(f64),
    /// No episodes.
    #[error("episodes: expected at least 1, got 0")]
    NoEpisodes,
    /// More or fewer points than the rules can give.
    #[error(
        "penalty_points: expected 0 to {most} ({MAX_EPISODE_PENALTY} for each of {episodes} episodes), got {points}",
        most = MAX_EPISODE_PENALTY * f64::from(*.episodes)
    )]
    PenaltyPoints {
        /// The points given.
        points: f64,
        /// The episodes they are for.
        episodes: u32,
    },
}

impl TaskScore {
    /// A task's score from its success rate (a fraction), penalty points and number of episodes.
    ///
    /// # Errors
    /// If a number is not finite or not possible by the rules.
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
        // −0 is a valid 0, but would be written with its sign.
        Ok(Self {
            success_rate: success_rate + 0.0,
            penalty_points: penalty_points + 0.0,
            episodes,
        })
    }

    fn tier(&self, bounds: &TierBounds) -> Tier {
        tier_within(bounds, self.penalty_points, self.episodes)
    }
}

impl TryFrom<RawTaskScore> for TaskScore {
    type Error = InvalidTaskScore;
    fn try_from(raw: RawTaskScore) -> Result<Self, InvalidTaskScore> {
        Self::new(raw.success_rate, raw.penalty_points, raw.episodes)
    }
}

/// `tasks.json`: each team's numbers in the three tasks, in the file's order.
///
/// Reading it refuses a team or a task that occurs twice, an unknown task, a missing task, unknown
/// fields, and numbers that the rules cannot give.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QualifyingSheet {
    teams: Vec<(TeamName, TaskScores)>,
}

#[derive(Debug, Clone, PartialEq)]
struct TaskScores(BTreeMap<Task, TaskScore>);

impl<'de> Deserialize<'de> for TaskScores {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let scores: BTreeMap<_, _> = UniqueMap::deserialize(deserializer)?
            .0
            .into_iter()
            .collect();
        match Task::ALL
            .into_iter()
            .find(|task| !scores.contains_key(task))
        {
            Some(task) => Err(D::Error::custom(format_args!(
                "task {task} is missing: expected hit, defend and prepare"
            ))),
            None => Ok(Self(scores)),
        }
    }
}

impl<'de> Deserialize<'de> for QualifyingSheet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self {
            teams: UniqueMap::deserialize(deserializer)?.0,
        })
    }
}

/// One row of the qualifying board; field names as in `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QualifyingRow {
    /// From 1 over the whole board.
    pub rank: u32,
    /// The team.
    pub team: TeamName,
    /// Overall tier: the worst over the tasks.
    pub tier: Tier,
    /// Overall score in percent.
    pub score: f64,
    /// Overall DS: the maximum over the tasks.
    pub penalty_points: f64,
    /// The tasks.
    pub tasks: BTreeMap<Task, TaskRow>,
}

/// One task of a row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TaskRow {
    /// From 1 over the whole board of this task.
    pub rank: u32,
    /// The task's tier.
    pub tier: Tier,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate.
    pub success_ci95: [f64; 2],
    /// The task's DS.
    pub penalty_points: f64,
    /// Episodes played.
    pub episodes: u32,
}

impl QualifyingSheet {
    /// The board, best first, ordered as [`overall_board`](crate::overall_board); the place in the
    /// sheet stands for the time of submission.
    #[must_use]
    pub fn board(&self) -> Vec<QualifyingRow> {
        self.board_by(&TaskWeights::default(), &TierBounds::default())
    }

    /// As [`Self::board`], by other weights and bounds than the ruleset's.
    #[must_use]
    pub fn board_by(&self, weights: &TaskWeights, bounds: &TierBounds) -> Vec<QualifyingRow> {
        let task_ranks = Task::ALL.map(|task| {
            self.ranks(|scores| {
                let score = scores.0[&task];
                (score.tier(bounds), score.success_rate, score.penalty_points)
            })
        });
        let ranks = self.ranks(|scores| {
            (
                scores.tier(bounds),
                scores.score(weights),
                scores.penalty_points(),
            )
        });
        let mut rows: Vec<_> = (0..)
            .zip(&self.teams)
            .map(|(place, (team, scores))| QualifyingRow {
                rank: ranks[place],
                team: team.clone(),
                tier: scores.tier(bounds),
                score: scores.score(weights),
                penalty_points: scores.penalty_points(),
                tasks: Task::ALL
                    .into_iter()
                    .zip(&task_ranks)
                    .map(|(task, ranks)| (task, scores.0[&task].row(ranks[place], bounds)))
                    .collect(),
            })
            .collect();
        rows.sort_by_key(|row| row.rank);
        rows
    }

    /// Each team's rank, in the sheet's order.
    fn ranks(&self, by: impl Fn(&TaskScores) -> (Tier, f64, f64)) -> Vec<u32> {
        let mut order: Vec<(usize, Placing)> = (0..)
            .zip(&self.teams)
            .map(|(place, (_, scores))| {
                let (tier, score, penalty_points) = by(scores);
                (place, Placing::new(tier, score, penalty_points, 0))
            })
            .collect();
        order.sort_by(|(_, a), (_, b)| a.board_order(b));
        let mut ranks = vec![0; order.len()];
        for (rank, (place, _)) in (1..).zip(order) {
            ranks[place] = rank;
        }
        ranks
    }
}

impl TaskScores {
    fn tier(&self, bounds: &TierBounds) -> Tier {
        self.0
            .values()
            .map(|score| score.tier(bounds))
            .max()
            .unwrap_or(Tier::Deployable)
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
    fn row(&self, rank: u32, bounds: &TierBounds) -> TaskRow {
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

use crate::{
    difference::{paired_difference, score_difference, unpaired_difference},
    evaluation::overall_score,
    paired::{PairedTally, SIGNIFICANCE, overall_p_value},
    summary::EpisodeSummary,
};
use faceoff_types::{Profile, Seed, Task, TaskWeights, Variation};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An evaluation as comparisons need it: its episodes and what they were drawn from.
#[derive(Debug, Clone, Copy)]
pub struct Played<'a> {
    /// The rules that it was scored by.
    pub ruleset: &'a str,
    /// The perturbations.
    pub profile: Profile,
    /// What it was played and scored by otherwise than the ruleset has it.
    pub variation: &'a Variation,
    /// The evaluation's seed: on a server, the day's.
    pub seed: Seed,
    /// The seed of the season's model mismatch.
    pub mismatch_seed: Seed,
    /// The episodes.
    pub summary: &'a EpisodeSummary,
}

/// Why two evaluations did not meet the same episodes; names the field that differs. Seeds are not
/// told, since they may be secret.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotPaired {
    /// Other rules.
    #[error("ruleset: the first evaluation was scored by {0}, the second by {1}")]
    Ruleset(String, String),
    /// Other perturbations.
    #[error("profile: the first evaluation played {0}, the second {1}")]
    Profile(Profile, Profile),
    /// Other weights, bounds or magnitudes: which of them.
    #[error("{0}: the two evaluations were played or scored by different {0}")]
    Variation(&'static str),
    /// Other draws.
    #[error("seed: the two evaluations have different seeds (another day, season or --seed)")]
    Seed,
    /// Another robot.
    #[error(
        "mismatch_seed: the two evaluations have different seeds of the model mismatch (another \
         season or --mismatch-seed)"
    )]
    MismatchSeed,
    /// A task that only one of the two played.
    #[error("tasks: only one of the two evaluations played {0}")]
    Tasks(Task),
    /// Not equally many.
    #[error("episodes: the first evaluation played {1} of {0}, the second {2}")]
    Episodes(Task, u32, u32),
}

impl NotPaired {
    /// The field that differs.
    #[must_use]
    pub const fn field(&self) -> &'static str {
        match self {
            Self::Ruleset(..) => "ruleset",
            Self::Profile(..) => "profile",
            Self::Variation(field) => field,
            Self::Seed => "seed",
            Self::MismatchSeed => "mismatch_seed",
            Self::Tasks(_) => "tasks",
            Self::Episodes(..) => "episodes",
        }
    }
}

/// Two evaluations on the same episodes. Differences are the first (A) minus the second (B).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// By task.
    pub tasks: BTreeMap<Task, TaskComparison>,
    /// Of the overall scores.
    pub overall: OverallComparison,
}

/// Two evaluations on the same episodes of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TaskComparison {
    /// Episodes that both solved.
    pub both: u32,
    /// Episodes that only A solved.
    pub only_a: u32,
    /// Episodes that only B solved.
    pub only_b: u32,
    /// Episodes that neither solved.
    pub neither: u32,
    /// A's success rate, a fraction.
    pub success_rate_a: f64,
    /// B's success rate, a fraction.
    pub success_rate_b: f64,
    /// Success rate of A minus that of B.
    pub difference: f64,
    /// Its 95 % interval for paired data: Newcombe's score interval (method 10).
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub difference_ci95: [f64; 2],
    /// McNemar's exact test, two-sided.
    pub p_value: f64,
    /// Is `p_value` at most [`SIGNIFICANCE`]?
    pub told_apart: bool,
}

/// The overall scores of two evaluations on the same episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct OverallComparison {
    /// A's score in percent.
    pub score_a: f64,
    /// B's score in percent.
    pub score_b: f64,
    /// Score of A minus that of B, in percentage points.
    pub difference: f64,
    /// Its 95 % interval: the tasks' intervals, weighed and joined by the square-and-add method.
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub difference_ci95: [f64; 2],
    /// The exact paired test of the weighted score ([`overall_p_value`]).
    pub p_value: f64,
    /// Is `p_value` at most [`SIGNIFICANCE`]?
    pub told_apart: bool,
}

impl Played<'_> {
    /// Compares with an evaluation that met the same episodes.
    ///
    /// # Errors
    /// If it did not: the field that differs.
    pub fn compare(&self, other: &Self) -> Result<Comparison, NotPaired> {
        let tallies = self.tallies(other)?;
        let estimates: BTreeMap<_, _> = tallies
            .iter()
            .map(|(task, tally)| (*task, paired_difference(tally)))
            .collect();
        let overall = score_difference(&self.variation.weights, estimates.clone());
        let [score_a, score_b] = [self, other].map(|played| played.score());
        let p_value = overall_p_value(&self.variation.weights, &tallies);
        let tasks = tallies.into_iter().zip(estimates.into_values());
        Ok(Comparison {
            tasks: tasks
                .map(|((task, tally), difference)| {
                    let n = f64::from(tally.episodes().max(1));
                    let p_value = tally.p_value();
                    let comparison = TaskComparison {
                        both: tally.both,
                        only_a: tally.only_a,
                        only_b: tally.only_b,
                        neither: tally.neither,
                        success_rate_a: f64::from(tally.both + tally.only_a) / n,
                        success_rate_b: f64::from(tally.both + tally.only_b) / n,
                        difference: difference.value,
                        difference_ci95: [difference.low, difference.high],
                        p_value,
                        told_apart: p_value <= SIGNIFICANCE,
                    };
                    (task, comparison)
                })
                .collect(),
            overall: OverallComparison {
                score_a,
                score_b,
                difference: overall.value,
                difference_ci95: [overall.low, overall.high],
                p_value,
                told_apart: p_value <= SIGNIFICANCE,
            },
        })
    }

    /// Can the two be told apart at [`SIGNIFICANCE`], by one task or by the overall score?
    ///
    /// On the same episodes by the paired test. On other episodes of the same kind (another day) by
    /// whether the 95 % interval of the difference, for independent episodes, leaves out zero. Under
    /// other rules or perturbations always: nothing says that they are alike.
    #[must_use]
    pub fn told_apart(&self, other: &Self, task: Option<Task>) -> bool {
        let of_interest = |any: &Task| task.is_none_or(|task| task == *any);
        match self.tallies(other) {
            Ok(mut tallies) => {
                tallies.retain(|any, _| of_interest(any));
                overall_p_value(&self.weights_of(task), &tallies) <= SIGNIFICANCE
            }
            Err(NotPaired::Seed | NotPaired::Episodes(..)) => {
                let differences = self.summary.tasks.iter().filter_map(|(any, mine)| {
                    let theirs = other.summary.tasks.get(any)?;
                    let counts =
                        [mine, theirs].map(|one| [one.successes.count(), one.successes.episodes()]);
                    Some((*any, unpaired_difference(counts[0], counts[1])))
                });
                score_difference(
                    &self.weights_of(task),
                    differences.filter(|(any, _)| of_interest(any)),
                )
                .excludes_zero()
            }
            Err(_) => true,
        }
    }

    /// Of one task alone the weight does not matter, even if it is none.
    fn weights_of(&self, task: Option<Task>) -> TaskWeights {
        match task {
            None => self.variation.weights,
            Some(_) => TaskWeights::default(),
        }
    }

    fn score(&self) -> f64 {
        overall_score(
            &self.variation.weights,
            self.summary.tasks.iter().map(|(task, summary)| {
                let successes = &summary.successes;
                let n = f64::from(successes.episodes().max(1));
                (*task, f64::from(successes.count()) / n)
            }),
        )
    }

    fn tallies(&self, other: &Self) -> Result<BTreeMap<Task, PairedTally>, NotPaired> {
        if self.ruleset != other.ruleset {
            return Err(NotPaired::Ruleset(
                self.ruleset.to_owned(),
                other.ruleset.to_owned(),
            ));
        }
        if self.profile != other.profile {
            return Err(NotPaired::Profile(self.profile, other.profile));
        }
        let (mine, theirs) = (self.variation, other.variation);
        for (field, differs) in [
            ("perturbations", mine.perturbations != theirs.perturbations),
            ("weights", mine.weights != theirs.weights),
            ("tier_bounds", mine.tier_bounds != theirs.tier_bounds),
        ] {
            if differs {
                return Err(NotPaired::Variation(field));
            }
        }
        if self.mismatch_seed != other.mismatch_seed {
            return Err(NotPaired::MismatchSeed);
        }
        let (a, b) = (&self.summary.tasks, &other.summary.tasks);
        let unshared = |a: &BTreeMap<Task, _>, b: &BTreeMap<Task, _>| {
            a.keys().find(|task| !b.contains_key(task)).copied()
        };
        if let Some(task) = unshared(a, b).or_else(|| unshared(b, a)) {
            return Err(NotPaired::Tasks(task));
        }
        if self.seed != other.seed {
            return Err(NotPaired::Seed);
        }
        a.iter()
            .zip(b.values())
            .map(|((task, a), b)| {
                let (a, b) = (&a.successes, &b.successes);
                let tally = PairedTally::of(*task, a, b)
                    .map_err(|_| NotPaired::Episodes(*task, a.episodes(), b.episodes()))?;
                Ok((*task, tally))
            })
            .collect()
    }
}

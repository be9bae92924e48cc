//! Comparison of two evaluations, A and B. On the same episodes (same seeds, rules and *profile*, which is the set of
//! perturbations of the simulation), the comparison is paired: each episode of A is matched with the same one of B.

use crate::{
    difference::{paired_difference, score_difference, unpaired_difference},
    evaluation::overall_score,
    paired_tests::{PairedTally, SIGNIFICANCE, overall_p_value},
    summary::EpisodeSummary,
};
use faceoff_types::{Profile, Seed, Task, TaskMap, TaskWeights, Variation, deprecated_names};
use serde::{Deserialize, Serialize};

/// An evaluation for a comparison: its rules, seeds and the results of its episodes.
#[derive(Debug, Clone, Copy)]
pub struct ComparedEvaluation<'a> {
    /// Name of the ruleset that scored the evaluation.
    pub ruleset: &'a str,
    /// The perturbation profile: a named set of disturbances of the simulation.
    pub profile: Profile,
    /// Deviations from the ruleset in perturbations and scoring.
    pub variation: &'a Variation,
    /// Weights of the tasks under the rules of the evaluation.
    pub weights: &'a TaskWeights,
    /// The evaluation's seed; on a server, that of the evaluation day.
    pub seed: Seed,
    /// The seed of the season's model mismatch: how the simulated robot differs from the robot model that teams have.
    pub mismatch_seed: Seed,
    /// Results of the episodes.
    pub summary: &'a EpisodeSummary,
}

/// The first field in which two evaluations differ, so that their episodes are not the same. Seeds are not
/// included, since they may be secret.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotComparable {
    /// Different rulesets.
    #[error("ruleset: the first evaluation was scored by {0}, the second by {1}")]
    Ruleset(String, String),
    /// Different perturbation profiles.
    #[error("profile: the first evaluation played {0}, the second {1}")]
    Profile(Profile, Profile),
    /// Different `weights`, `tier_bounds` or `perturbations`; the name of the field.
    #[error("{0}: the two evaluations were played or scored by different {0}")]
    Variation(&'static str),
    /// Different evaluation seeds.
    #[error("seed: the two evaluations have different seeds (another day, season or --seed)")]
    Seed,
    /// Different robots, by the seed of the model mismatch.
    #[error(
        "mismatch_seed: the two evaluations have different seeds of the model mismatch (another \
         season or --mismatch-seed)"
    )]
    MismatchSeed,
    /// A task that only one of the two includes.
    #[error("tasks: only one of the two evaluations played {0}")]
    Tasks(Task),
    /// Different numbers of episodes of a task.
    #[error("episodes: the first evaluation played {1} of {0}, the second {2}")]
    Episodes(Task, u32, u32),
}

impl NotComparable {
    /// Name of the field that differs, as in JSON.
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

/// Two evaluations on the same episodes. Differences are those of A (the first) minus B (the second).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// One comparison for each task.
    pub tasks: TaskMap<TaskComparison>,
    /// The overall scores.
    pub overall: OverallComparison,
}

/// Two evaluations on the same episodes of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
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
    /// 95 % interval of the difference for paired data: Newcombe's score interval (method 10).
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub difference_ci95: [f64; 2],
    /// P-value of McNemar's exact test, two-sided.
    pub p_value: f64,
    /// Is `p_value` at most [`SIGNIFICANCE`]?
    pub significant: bool,
}
// `told_apart` is the former JSON name of `significant`.
deprecated_names!(TaskComparison { told_apart => significant });

/// The overall scores of two evaluations on the same episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct OverallComparison {
    /// A's score in percent.
    pub score_a: f64,
    /// B's score in percent.
    pub score_b: f64,
    /// Score of A minus that of B, in percentage points.
    pub difference: f64,
    /// 95 % interval of the difference: the weighted intervals of the tasks, combined by the square-and-add method.
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub difference_ci95: [f64; 2],
    /// The exact paired test of the weighted score ([`overall_p_value`]).
    pub p_value: f64,
    /// Is `p_value` at most [`SIGNIFICANCE`]?
    pub significant: bool,
}
// `told_apart` is the former JSON name of `significant`.
deprecated_names!(OverallComparison { told_apart => significant });

impl ComparedEvaluation<'_> {
    /// Compares two evaluations on the same episodes.
    ///
    /// # Errors
    /// If the episodes are not the same: the field that differs.
    pub fn compare(&self, other: &Self) -> Result<Comparison, NotComparable> {
        let tallies = self.paired_tallies(other)?;
        let estimates: TaskMap<_> = tallies
            .iter()
            .map(|(task, tally)| (*task, paired_difference(tally)))
            .collect();
        let overall = score_difference(self.weights, estimates.clone());
        let [score_a, score_b] = [self, other].map(Self::score);
        let p_value = overall_p_value(self.weights, &tallies);
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
                        significant: p_value <= SIGNIFICANCE,
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
                significant: p_value <= SIGNIFICANCE,
            },
        })
    }

    /// Do the two differ significantly, at [`SIGNIFICANCE`], in one task or (`None`) in the overall score?
    ///
    /// On the same episodes the paired test decides. On other episodes of the same kind (another day) the 95 % interval of
    /// the difference, for independent episodes, decides: zero must lie outside of it. Under different rules or
    /// perturbations nothing can be compared, and the result is always true: such evaluations are never in one rank group.
    #[must_use]
    pub fn differs_significantly(&self, other: &Self, task: Option<Task>) -> bool {
        let is_selected = |candidate: &Task| task.is_none_or(|task| task == *candidate);
        match self.paired_tallies(other) {
            Ok(mut tallies) => {
                tallies.retain(|candidate, _| is_selected(candidate));
                overall_p_value(&self.weights_of(task), &tallies) <= SIGNIFICANCE
            }
            Err(NotComparable::Seed | NotComparable::Episodes(..)) => {
                let differences = self.summary.tasks.iter().filter_map(|(candidate, a)| {
                    let b = other.summary.tasks.get(candidate)?;
                    let [a, b] = [a, b]
                        .map(|summary| [summary.successes.count(), summary.successes.episodes()]);
                    Some((*candidate, unpaired_difference(a, b)))
                });
                score_difference(
                    &self.weights_of(task),
                    differences.filter(|(candidate, _)| is_selected(candidate)),
                )
                .excludes_zero()
            }
            Err(_) => true,
        }
    }

    /// The weights for a test. For a single task the size of its weight does not matter.
    fn weights_of(&self, task: Option<Task>) -> TaskWeights {
        match task {
            None => self.weights.clone(),
            Some(task) => TaskWeights::of(task),
        }
    }

    /// The overall score in percent.
    fn score(&self) -> f64 {
        overall_score(
            self.weights,
            self.summary.tasks.iter().map(|(task, summary)| {
                let successes = &summary.successes;
                let n = f64::from(successes.episodes().max(1));
                (*task, f64::from(successes.count()) / n)
            }),
        )
    }

    /// Counts for each task the episodes that both, one or neither solved, after checking that both evaluations have the same episodes.
    fn paired_tallies(&self, other: &Self) -> Result<TaskMap<PairedTally>, NotComparable> {
        if self.ruleset != other.ruleset {
            return Err(NotComparable::Ruleset(
                self.ruleset.to_owned(),
                other.ruleset.to_owned(),
            ));
        }
        if self.profile != other.profile {
            return Err(NotComparable::Profile(self.profile, other.profile));
        }
        let (a, b) = (self.variation, other.variation);
        for (field, differs) in [
            ("perturbations", a.perturbations != b.perturbations),
            ("weights", a.weights != b.weights),
            ("tier_bounds", a.tier_bounds != b.tier_bounds),
        ] {
            if differs {
                return Err(NotComparable::Variation(field));
            }
        }
        if self.mismatch_seed != other.mismatch_seed {
            return Err(NotComparable::MismatchSeed);
        }
        let (a, b) = (&self.summary.tasks, &other.summary.tasks);
        let first_missing = |incomplete: &TaskMap<_>, tasks: &TaskMap<_>| {
            let mut names = tasks.keys();
            names.find(|task| !incomplete.contains_key(*task)).copied()
        };
        if let Some(task) = first_missing(b, a).or_else(|| first_missing(a, b)) {
            return Err(NotComparable::Tasks(task));
        }
        if self.seed != other.seed {
            return Err(NotComparable::Seed);
        }
        a.iter()
            .filter_map(|(task, a)| Some((task, a, b.get(task)?)))
            .map(|(task, a, b)| {
                let (a, b) = (&a.successes, &b.successes);
                let tally = PairedTally::from_successes(*task, a, b)
                    .map_err(|_| NotComparable::Episodes(*task, a.episodes(), b.episodes()))?;
                Ok((*task, tally))
            })
            .collect()
    }
}

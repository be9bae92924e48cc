//! Paired tests: do two teams, A and B, that played the same episodes differ by more than chance?

use crate::{binomial::SymmetricBinomial, successes::Successes};
use faceoff_types::{Task, TaskMap, TaskWeights};
use std::collections::BTreeMap;

/// Significance level: two teams differ significantly if an equal or larger difference arises by chance with at most
/// this probability.
pub const SIGNIFICANCE: f64 = 0.05;

/// Successes of two teams on the same episodes of one task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairedTally {
    /// Episodes in which both succeeded.
    pub both: u32,
    /// Episodes in which only the first team succeeded.
    pub only_a: u32,
    /// Episodes in which only the second team succeeded.
    pub only_b: u32,
    /// Episodes in which neither succeeded.
    pub neither: u32,
}

/// Why two agents' episodes cannot be paired.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PairingError {
    /// Two outcomes have the same episode number.
    #[error("{0} episode {1} occurs twice")]
    Repeated(Task, u32),
    /// An episode number was skipped.
    #[error("{0} episode {1} is missing")]
    Missing(Task, u32),
    /// The first episode that only one agent played.
    #[error("{0} episode {1} was played by one of the two only")]
    Unpaired(Task, u32),
}

impl PairedTally {
    /// Pairs two teams' episodes of one task.
    ///
    /// The caller ensures that both have the same evaluation seed and profile, and therefore the same episodes.
    ///
    /// # Errors
    /// If their numbers of episodes differ.
    pub fn from_successes(task: Task, a: &Successes, b: &Successes) -> Result<Self, PairingError> {
        if a.episodes() != b.episodes() {
            let first = a.episodes().min(b.episodes());
            return Err(PairingError::Unpaired(task, first));
        }
        let both = a.count_common(b);
        let (only_a, only_b) = (a.count() - both, b.count() - both);
        Ok(Self {
            both,
            only_a,
            only_b,
            neither: a.episodes() - both - only_a - only_b,
        })
    }

    /// Number of episodes, the sum of all four counts.
    #[must_use]
    pub const fn episodes(&self) -> u32 {
        self.both + self.only_a + self.only_b + self.neither
    }

    /// McNemar's exact test, two-sided, over the episodes in which exactly one team succeeded: the probability of an
    /// equally uneven or more uneven split if both teams are equally good.
    #[must_use]
    pub fn p_value(&self) -> f64 {
        // With a single task neither name nor weight matters.
        const ONLY: Task = Task::new("only");
        overall_p_value(&TaskWeights::of(ONLY), &TaskMap::from([(ONLY, *self)]))
    }
}

/// The exact paired test of two teams' overall scores, two-sided: McNemar's test, extended to the weighted score.
///
/// If two teams are equally good, each episode that only one of them solved is like a fair coin toss. The difference of
/// the overall scores is Σ weight · (only a − only b) / episodes over the tasks. The p-value is the probability of an
/// equal or larger difference in either direction. With one task this is McNemar's exact test. Differences are compared
/// as integers.
#[must_use]
pub fn overall_p_value(weights: &TaskWeights, tallies: &TaskMap<PairedTally>) -> f64 {
    // Tasks with weight 0 have no influence.
    let weighted = || {
        let has_influence = |task: &Task, tally: &PairedTally| {
            tally.episodes() > 0 && weights.weight(*task).count() > 0
        };
        tallies
            .iter()
            .filter(move |(task, tally)| has_influence(task, tally))
    };
    // The common denominator of the tasks' success rates: with it all differences are integers.
    let denominator = weighted().fold(1, |denominator, (_, tally)| {
        lcm(denominator, i128::from(tally.episodes()))
    });

    // Tasks whose episodes have the same weight are combined.
    let mut tosses_by_weight = BTreeMap::<i128, u32>::new();
    let mut difference = 0;
    for (task, tally) in weighted() {
        let weight = i128::from(weights.weight(*task).count())
            * (denominator / i128::from(tally.episodes()));
        *tosses_by_weight.entry(weight).or_default() += tally.only_a + tally.only_b;
        difference += weight * (i128::from(tally.only_a) - i128::from(tally.only_b));
    }
    if difference == 0 {
        return 1.0;
    }
    let mut groups: Vec<_> = tosses_by_weight
        .into_iter()
        .map(|(weight, tosses)| WeightedTosses {
            weight,
            tosses,
            heads: SymmetricBinomial::new(tosses),
        })
        .collect();
    // `tail_probability` looks up the tail of the last group and enumerates all outcomes of the others: the largest group
    // is therefore the last.
    groups.sort_by_key(|group| group.tosses);
    (2.0 * tail_probability(&groups, difference.abs())).min(1.0)
}

/// Fair coin tosses, one for each episode that only one team solved; heads add `weight`, tails subtract it.
struct WeightedTosses {
    weight: i128,
    tosses: u32,
    /// Distribution of the number of heads.
    heads: SymmetricBinomial,
}

/// P(Σ weight · (heads − tails) ≥ `sum`) over all groups.
fn tail_probability(groups: &[WeightedTosses], sum: i128) -> f64 {
    let Some((group, rest)) = groups.split_first() else {
        return if sum <= 0 { 1.0 } else { 0.0 };
    };
    let all_heads = group.weight * i128::from(group.tosses);
    if rest.is_empty() {
        // weight · (2 heads − tosses) ≥ sum, for the smallest whole number of heads
        let doubled = 2 * group.weight;
        return group
            .heads
            .at_least((sum + all_heads + doubled - 1).div_euclid(doubled));
    }
    (0..)
        .zip(group.heads.probabilities())
        .map(|(heads, probability)| {
            probability * tail_probability(rest, sum - (2 * group.weight * heads - all_heads))
        })
        .sum()
}

/// The least common multiple.
fn lcm(a: i128, b: i128) -> i128 {
    let (mut divisor, mut rest) = (a, b);
    while rest != 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    a / divisor * b
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use faceoff_airhockey::TASKS;

    pub(crate) fn tally(both: u32, only_a: u32, only_b: u32, neither: u32) -> PairedTally {
        PairedTally {
            both,
            only_a,
            only_b,
            neither,
        }
    }

    #[test]
    fn mcnemar_is_two_sided_sign_test_of_discordant_pairs() {
        // 2 · Σ_{k ≤ min} C(n, k) / 2ⁿ, by hand
        for (only_a, only_b, p) in [
            (0, 0, 1.0),
            (1, 0, 1.0),
            (5, 5, 1.0),
            (0, 5, 2.0 / 32.0),
            (6, 0, 2.0 / 64.0),
            (8, 2, 2.0 * (1.0 + 10.0 + 45.0) / 1024.0),
            (3, 9, 2.0 * (1.0 + 12.0 + 66.0 + 220.0) / 4096.0),
        ] {
            let got = tally(7, only_a, only_b, 11).p_value();
            assert!(
                (got - p).abs() < 1e-14,
                "{only_a} against {only_b}: {got}, expected {p}"
            );
        }
    }

    #[test]
    fn overall_p_value_agrees_with_enumeration() {
        let cases = [
            [tally(1, 3, 1, 5), tally(2, 0, 2, 6), tally(0, 4, 1, 5)],
            [tally(1, 3, 1, 5), tally(2, 0, 2, 3), tally(0, 1, 4, 7)],
            [tally(0, 5, 0, 0), tally(0, 3, 0, 1), tally(0, 0, 3, 3)],
        ];
        let all_weights = ["0.4,0.4,0.2", "0.2,0.3,0.5", "0,0.7,0.3", "1,0,0"];
        for (tallies, weights) in cases
            .into_iter()
            .flat_map(|tallies| all_weights.map(|weights| (tallies, weights)))
        {
            let weights = TaskWeights::parse(weights, TASKS.into_iter()).unwrap();
            let tallies: TaskMap<_> = TASKS.into_iter().zip(tallies).collect();
            let difference = |only_a: &dyn Fn(Task) -> u32| -> f64 {
                tallies
                    .iter()
                    .map(|(task, tally)| {
                        let discordant = tally.only_a + tally.only_b;
                        let lead = 2.0 * f64::from(only_a(*task)) - f64::from(discordant);
                        f64::from(weights.weight(*task).count()) * lead
                            / f64::from(tally.episodes())
                    })
                    .sum()
            };
            let observed = difference(&|task| tallies[&task].only_a).abs();
            let tosses: Vec<Task> = tallies
                .iter()
                .flat_map(|(task, t)| std::iter::repeat_n(*task, (t.only_a + t.only_b) as usize))
                .collect();
            let extreme = (0u32..1 << tosses.len())
                .filter(|bits| {
                    let heads = |task| {
                        (0..tosses.len())
                            .filter(|&i| tosses[i] == task && bits >> i & 1 == 1)
                            .count() as u32
                    };
                    difference(&heads).abs() >= observed * (1.0 - 1e-9)
                })
                .count();
            let expected = extreme as f64 / f64::from(1u32 << tosses.len());
            let got = overall_p_value(&weights, &tallies);
            assert!((got - expected).abs() < 1e-12, "{got}, expected {expected}");
        }
    }

    #[test]
    fn clear_lead_is_significant() {
        let weights = TaskWeights::parse("0.4,0.4,0.2", TASKS.into_iter()).unwrap();
        let lead = |task_lead: u32| tally(300, 150 + task_lead, 150, 400 - task_lead);
        let p = |hit, defend, prepare| {
            let leads = [lead(hit), lead(defend), lead(prepare)];
            overall_p_value(&weights, &TASKS.into_iter().zip(leads).collect())
        };
        assert!(p(60, 60, 0) < 1e-4);
        assert!(p(5, 0, 0) > 0.5);
        assert_eq!(p(0, 0, 0), 1.0);
        assert_eq!(overall_p_value(&weights, &TaskMap::new()), 1.0);
    }
}

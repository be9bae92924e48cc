use crate::{binomial::FairTosses, successes::Successes};
use faceoff_types::{Task, TaskWeights};
use std::collections::BTreeMap;

/// Two teams are told apart when a difference like theirs, or a larger one, would come by chance with
/// at most this probability.
pub const SIGNIFICANCE: f64 = 0.05;

/// How two teams did on the same episodes of one task.
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

/// Why episodes cannot be paired with another agent's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PairingError {
    /// Which of the two counts?
    #[error("{0} episode {1} occurs twice")]
    Repeated(Task, u32),
    /// Episodes are numbered without gaps.
    #[error("{0} episode {1} is missing")]
    Missing(Task, u32),
    /// The first episode that only one of the two played.
    #[error("{0} episode {1} was played by one of the two only")]
    Unpaired(Task, u32),
}

impl PairedTally {
    /// Pairs two teams' episodes of one task.
    ///
    /// The caller sees to it that both come from the same evaluation seed and profile: only then did
    /// both teams meet the same episodes.
    ///
    /// # Errors
    /// If the two did not play equally many.
    pub fn of(task: Task, a: &Successes, b: &Successes) -> Result<Self, PairingError> {
        if a.episodes() != b.episodes() {
            let first = a.episodes().min(b.episodes());
            return Err(PairingError::Unpaired(task, first));
        }
        let both = a.in_common(b);
        let (only_a, only_b) = (a.count() - both, b.count() - both);
        Ok(Self {
            both,
            only_a,
            only_b,
            neither: a.episodes() - both - only_a - only_b,
        })
    }

    /// Episodes played.
    #[must_use]
    pub const fn episodes(&self) -> u32 {
        self.both + self.only_a + self.only_b + self.neither
    }

    /// McNemar's exact test, two-sided: the probability that as uneven a split of the episodes in which
    /// exactly one team succeeded, or a more uneven one, comes by chance if both are equally good.
    #[must_use]
    pub fn p_value(&self) -> f64 {
        // One task alone: its weight does not matter.
        overall_p_value(
            &TaskWeights::default(),
            &BTreeMap::from([(Task::Hit, *self)]),
        )
    }
}

/// The exact paired test of two teams' overall scores, two-sided: McNemar's test, carried over to the
/// weighted score.
///
/// If two teams are equally good, then in each episode that only one of them solved either could have
/// been the one, like a fair toss. The difference of the overall scores is Σ weight · (only a − only b)
/// / episodes over the tasks; the p-value is the probability that tosses bring as large a difference,
/// in either direction. With one task this is McNemar's exact test. All comparisons of differences are
/// made on integers.
#[must_use]
pub fn overall_p_value(weights: &TaskWeights, tallies: &BTreeMap<Task, PairedTally>) -> f64 {
    // What weighs nothing decides nothing.
    let played = || {
        let counts = |task: &Task, tally: &PairedTally| {
            tally.episodes() > 0 && weights.of(*task).count() > 0
        };
        tallies
            .iter()
            .filter(move |(task, tally)| counts(task, tally))
    };
    let common = played().fold(1, |common, (_, tally)| {
        lcm(common, i128::from(tally.episodes()))
    });

    // Tasks whose episodes weigh the same are one long row of tosses.
    let mut tosses_by_weight = BTreeMap::<i128, u32>::new();
    let mut difference = 0;
    for (task, tally) in played() {
        let weight =
            i128::from(weights.of(*task).count()) * (common / i128::from(tally.episodes()));
        *tosses_by_weight.entry(weight).or_default() += tally.only_a + tally.only_b;
        difference += weight * (i128::from(tally.only_a) - i128::from(tally.only_b));
    }
    if difference == 0 {
        return 1.0;
    }
    let mut rows: Vec<_> = tosses_by_weight
        .into_iter()
        .map(|(weight, tosses)| Row {
            weight,
            tosses,
            heads: FairTosses::new(tosses),
        })
        .collect();
    // The last row is looked up, the others are walked through: let the longest be the last.
    rows.sort_by_key(|row| row.tosses);
    (2.0 * at_least(&rows, difference.abs())).min(1.0)
}

/// Tosses whose heads count `weight` and whose tails count `−weight`.
struct Row {
    weight: i128,
    tosses: u32,
    heads: FairTosses,
}

/// P(Σ weight · (heads − tails) ≥ `sum`) over all rows.
fn at_least(rows: &[Row], sum: i128) -> f64 {
    let Some((row, rest)) = rows.split_first() else {
        return if sum <= 0 { 1.0 } else { 0.0 };
    };
    let all_heads = row.weight * i128::from(row.tosses);
    if rest.is_empty() {
        // weight · (2 heads − tosses) ≥ sum, for the smallest whole number of heads
        let doubled = 2 * row.weight;
        return row
            .heads
            .at_least((sum + all_heads + doubled - 1).div_euclid(doubled));
    }
    (0..)
        .zip(row.heads.probabilities())
        .map(|(heads, probability)| {
            probability * at_least(rest, sum - (2 * row.weight * heads - all_heads))
        })
        .sum()
}

fn lcm(a: i128, b: i128) -> i128 {
    let (mut divisor, mut rest) = (a, b);
    while rest != 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    a / divisor * b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(both: u32, only_a: u32, only_b: u32, neither: u32) -> PairedTally {
        PairedTally {
            both,
            only_a,
            only_b,
            neither,
        }
    }

    #[test]
    fn mcnemar_is_the_two_sided_sign_test_of_the_uneven_pairs() {
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
    fn the_overall_test_agrees_with_counting_every_toss() {
        let cases = [
            [tally(1, 3, 1, 5), tally(2, 0, 2, 6), tally(0, 4, 1, 5)],
            [tally(1, 3, 1, 5), tally(2, 0, 2, 3), tally(0, 1, 4, 7)],
            [tally(0, 5, 0, 0), tally(0, 3, 0, 1), tally(0, 0, 3, 3)],
        ];
        let others = ["0.4,0.4,0.2", "0.2,0.3,0.5", "0,0.7,0.3", "1,0,0"];
        for (tallies, weights) in cases
            .into_iter()
            .flat_map(|tallies| others.map(|weights| (tallies, weights)))
        {
            let weights: TaskWeights = weights.parse().unwrap();
            let tallies: BTreeMap<_, _> = Task::ALL.into_iter().zip(tallies).collect();
            let difference = |only_a: &dyn Fn(Task) -> u32| -> f64 {
                tallies
                    .iter()
                    .map(|(task, tally)| {
                        let discordant = tally.only_a + tally.only_b;
                        let lead = 2.0 * f64::from(only_a(*task)) - f64::from(discordant);
                        f64::from(weights.of(*task).count()) * lead / f64::from(tally.episodes())
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
    fn a_clear_lead_over_a_whole_evaluation_is_told_apart() {
        let lead = |task_lead: u32| tally(300, 150 + task_lead, 150, 400 - task_lead);
        let p = |hit, defend, prepare| {
            let leads = [lead(hit), lead(defend), lead(prepare)];
            overall_p_value(
                &TaskWeights::default(),
                &Task::ALL.into_iter().zip(leads).collect(),
            )
        };
        assert!(p(60, 60, 0) < 1e-4);
        assert!(p(5, 0, 0) > 0.5);
        assert_eq!(p(0, 0, 0), 1.0);
        assert_eq!(
            overall_p_value(&TaskWeights::default(), &BTreeMap::new()),
            1.0
        );
    }
}

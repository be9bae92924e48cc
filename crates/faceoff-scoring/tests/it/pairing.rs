//! Tests of paired tests: two teams on the same episodes.

use crate::support::{bounds, episode, weights};
use faceoff_airhockey::{HIT, TASKS};
use faceoff_scoring::{EpisodeSummary, PairedTally, PairingError, Successes, overall_p_value};
use faceoff_types::{EpisodeEnd, EpisodeOutcome, TaskMap};
use proptest::prelude::*;

fn outcomes(successes: &[bool]) -> Vec<EpisodeOutcome> {
    (0..)
        .zip(successes)
        .map(|(index, success)| EpisodeOutcome {
            success: *success,
            ..episode(HIT, index)
        })
        .collect()
}

fn tally(a: &[EpisodeOutcome], b: &[EpisodeOutcome]) -> Result<PairedTally, PairingError> {
    let solved = |outcomes: &[EpisodeOutcome]| -> Result<Successes, PairingError> {
        let mut summary = EpisodeSummary::from_outcomes(
            &faceoff_airhockey::competition(),
            outcomes,
            &TASKS,
            bounds(),
        )?;
        let hit = summary.tasks.swap_remove(&HIT);
        Ok(hit.map_or_else(|| [].into_iter().collect(), |hit| hit.successes))
    };
    PairedTally::from_successes(HIT, &solved(a)?, &solved(b)?)
}

#[test]
fn episodes_are_paired_by_their_number() {
    let a = outcomes(&[true, true, false, false, false]);
    let mut b = outcomes(&[true, false, true, true, false]);
    b.reverse();
    let paired = tally(&a, &b).unwrap();
    assert_eq!(
        paired,
        PairedTally {
            both: 1,
            only_a: 1,
            only_b: 2,
            neither: 1
        }
    );
    assert_eq!(paired.episodes(), 5);
}

#[test]
fn episode_with_fault_is_no_success() {
    let a = outcomes(&[true]);
    let mut b = outcomes(&[true]);
    b[0].end = EpisodeEnd::AGENT_FAULT;
    assert_eq!(tally(&a, &b).unwrap().only_a, 1);
}

#[test]
fn unpairable_episodes_are_refused() {
    let (short, long) = (outcomes(&[true; 3]), outcomes(&[true; 4]));
    let unpaired = Err(PairingError::Unpaired(HIT, 3));
    assert_eq!(tally(&short, &long), unpaired);
    assert_eq!(tally(&long, &short), unpaired);
    let repeated = [short[0].clone(), short[1].clone(), short[1].clone()];
    assert_eq!(
        tally(&short, &repeated),
        Err(PairingError::Repeated(HIT, 1))
    );
    assert_eq!(tally(&[], &[]).unwrap().p_value(), 1.0);
}

proptest! {
    #[test]
    fn p_value_is_a_symmetric_probability(
        counts in prop::array::uniform3((0u32..40, 0u32..40, 0u32..40, 1u32..40))
    ) {
        let tally = |swap: bool| -> TaskMap<PairedTally> {
            TASKS
                .into_iter()
                .zip(counts)
                .map(|(task, (both, only_a, only_b, neither))| {
                    let (only_a, only_b) = if swap { (only_b, only_a) } else { (only_a, only_b) };
                    (task, PairedTally { both, only_a, only_b, neither })
                })
                .collect()
        };
        let p = overall_p_value(&weights(), &tally(false));
        prop_assert!(0.0 < p && p <= 1.0, "{}", p);
        prop_assert_eq!(p, overall_p_value(&weights(), &tally(true)));
    }

    #[test]
    fn p_value_does_not_increase_with_lead(discordant in 1u32..300) {
        let p = |only_a| {
            PairedTally { only_a, only_b: discordant - only_a, ..PairedTally::default() }.p_value()
        };
        for only_a in discordant.div_ceil(2)..discordant {
            prop_assert!(p(only_a + 1) <= p(only_a));
        }
    }
}

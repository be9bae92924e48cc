use crate::support::episode;
use faceoff_scoring::{
    EpisodeSummary, NotPaired, PairedTally, PairingError, Played, StepTimes, overall_p_value,
    overall_score, score_task,
};
use faceoff_types::{
    EpisodeOutcome, Profile, RULESET, Seed, Task, TierBounds, Variation, Violations,
};
use proptest::prelude::*;
use std::{collections::BTreeMap, sync::LazyLock};

/// `solved` decides by task and episode.
fn outcomes(episodes: u32, solved: impl Fn(Task, u32) -> bool) -> Vec<EpisodeOutcome> {
    let solved = &solved;
    Task::ALL
        .into_iter()
        .flat_map(|task| {
            (0..episodes).map(move |index| EpisodeOutcome {
                success: solved(task, index),
                ..episode(task, index)
            })
        })
        .collect()
}

fn summary(outcomes: &[EpisodeOutcome]) -> EpisodeSummary {
    EpisodeSummary::of(outcomes, &Default::default()).unwrap()
}

fn played(summary: &EpisodeSummary) -> Played<'_> {
    Played {
        ruleset: RULESET,
        profile: Profile::Evaluation,
        variation: &RULESETS,
        seed: Seed::from_number(1),
        mismatch_seed: Seed::from_number(2),
        summary,
    }
}

/// Nothing but what the ruleset has.
static RULESETS: LazyLock<Variation> = LazyLock::new(Variation::default);

#[test]
fn other_weights_and_bounds_count_and_are_not_compared_with_the_rulesets() {
    let a = summary(&outcomes(100, |task, e| match task {
        Task::Hit => e < 80,
        _ => e < 50,
    }));
    let b = summary(&outcomes(100, |task, e| match task {
        Task::Prepare => e < 99,
        _ => e < 50,
    }));
    let by = |weights: &str| Variation {
        weights: weights.parse().unwrap(),
        ..Variation::default()
    };
    let score = |variation: &Variation| {
        let of = |summary| Played {
            variation,
            ..played(summary)
        };
        let compared = of(&a).compare(&of(&b)).unwrap();
        (
            compared.overall.score_a,
            compared.overall.score_b,
            compared.overall.told_apart,
        )
    };
    assert_eq!(score(&by("1,0,0")), (80.0, 50.0, true));
    assert_eq!(score(&by("0,0,1")), (50.0, 99.0, true));
    assert_eq!(score(&by("0,1,0")), (50.0, 50.0, false));
    // A task that weighs nothing has its own board all the same.
    let nothing = by("0,1,0");
    let of = |summary| Played {
        variation: &nothing,
        ..played(summary)
    };
    assert!(of(&a).told_apart(&of(&b), Some(Task::Hit)));
    assert!(!of(&a).told_apart(&of(&b), None));

    let mut calm = Variation::default();
    calm.perturbations.tracking_loss.probability = 0.0;
    let bounds = Variation {
        tier_bounds: "0.1,0.2".parse().unwrap(),
        ..Variation::default()
    };
    for (other, field) in [
        (by("1,0,0"), "weights"),
        (bounds, "tier_bounds"),
        (calm, "perturbations"),
    ] {
        let theirs = Played {
            variation: &other,
            ..played(&a)
        };
        let refused = played(&a).compare(&theirs).unwrap_err();
        assert_eq!(refused, NotPaired::Variation(field));
        assert_eq!(refused.field(), field);
        assert!(played(&a).told_apart(&theirs, None));
    }
}

#[test]
fn how_sure_a_tier_is_depends_on_its_bounds() {
    let all = outcomes(100, |_, _| true);
    let costly: Vec<_> = all
        .into_iter()
        .map(|outcome| EpisodeOutcome {
            violations: Violations {
                joint_vel: outcome.episode < 10,
                ..Violations::default()
            },
            ..outcome
        })
        .collect();
    let sure = EpisodeSummary::of(&costly, &TierBounds::default()).unwrap();
    assert_eq!(sure.tier_change, 0.0, "10 points of 50");
    let tight = EpisodeSummary::of(&costly, &"0.1,0.5".parse().unwrap()).unwrap();
    assert!(
        tight.tier_change > 0.5,
        "10 points of 10, three times: {}",
        tight.tier_change
    );
}

#[test]
fn a_comparison_counts_episodes_and_says_how_sure_it_is() {
    let a = summary(&outcomes(100, |task, e| match task {
        Task::Hit => e < 60,
        Task::Defend => e % 2 == 0,
        Task::Prepare => true,
    }));
    let b = summary(&outcomes(100, |task, e| match task {
        Task::Hit => (20..50).contains(&e),
        Task::Defend => e % 2 == 0,
        Task::Prepare => e > 0,
    }));
    let comparison = played(&a).compare(&played(&b)).unwrap();
    let hit = &comparison.tasks[&Task::Hit];
    assert_eq!(
        (hit.both, hit.only_a, hit.only_b, hit.neither),
        (30, 30, 0, 40)
    );
    assert_eq!((hit.success_rate_a, hit.success_rate_b), (0.6, 0.3));
    assert!((hit.difference - 0.3).abs() < 1e-12);
    assert!(hit.p_value < 1e-8 && hit.told_apart);
    let [low, high] = hit.difference_ci95;
    assert!(
        0.2 < low && low < 0.3 && 0.3 < high && high < 0.4,
        "{hit:?}"
    );
    let defend = &comparison.tasks[&Task::Defend];
    assert_eq!((defend.difference, defend.p_value), (0.0, 1.0));
    assert!(defend.difference_ci95[0] < 0.0 && defend.difference_ci95[1] > 0.0);
    assert!(!comparison.tasks[&Task::Prepare].told_apart);
    let overall = &comparison.overall;
    assert_eq!((overall.score_a, overall.score_b), (64.0, 51.8));
    assert!((overall.difference - 12.2).abs() < 1e-9);
    assert!(overall.told_apart && overall.difference_ci95[0] > 0.0);
}

#[test]
fn what_does_not_pair_is_refused_by_the_field_that_differs() {
    let all = summary(&outcomes(4, |_, _| true));
    let longer = summary(&outcomes(5, |_, _| true));
    let mut hit_alone = outcomes(4, |_, _| true);
    hit_alone.retain(|outcome| outcome.task == Task::Hit);
    let hit_alone = summary(&hit_alone);
    let a = played(&all);
    let refused = [
        (
            Played {
                ruleset: "other",
                ..a
            },
            "ruleset",
        ),
        (
            Played {
                profile: Profile::Ideal,
                ..a
            },
            "profile",
        ),
        (
            Played {
                seed: Seed::from_number(9),
                ..a
            },
            "seed",
        ),
        (
            Played {
                mismatch_seed: Seed::from_number(9),
                ..a
            },
            "mismatch_seed",
        ),
        (played(&longer), "episodes"),
        (played(&hit_alone), "tasks"),
    ];
    for (b, field) in refused {
        for (a, b) in [(&a, &b), (&b, &a)] {
            let refusal = a.compare(b).unwrap_err();
            assert_eq!(refusal.field(), field);
            let message = refusal.to_string();
            assert!(message.starts_with(field), "{message}");
            assert!(!message.contains(&a.seed.to_string()[..8]), "{message}");
        }
    }
    assert_eq!(
        a.compare(&played(&hit_alone)),
        Err(NotPaired::Tasks(Task::Defend))
    );
}

#[test]
fn without_pairs_the_rates_themselves_must_differ() {
    // Paired, 20 episodes that only one solved tell; apart, 48 % and 50 % of 1000 do not.
    let a = summary(&outcomes(1000, |task, e| task == Task::Hit && e < 500));
    let b = summary(&outcomes(1000, |task, e| task == Task::Hit && e < 480));
    let c = summary(&outcomes(1000, |task, e| task == Task::Hit && e < 400));
    let (first, second) = (played(&a), played(&b));
    assert!(first.told_apart(&second, None) && first.told_apart(&second, Some(Task::Hit)));
    assert!(!first.told_apart(&second, Some(Task::Defend)));
    let another_day = |summary| Played {
        seed: Seed::from_number(9),
        ..played(summary)
    };
    assert!(!first.told_apart(&another_day(&b), None));
    assert!(first.told_apart(&another_day(&c), None));
    assert!(first.told_apart(&another_day(&c), Some(Task::Hit)));
    let other_rules = Played {
        ruleset: "other",
        ..first
    };
    assert!(
        first.told_apart(&other_rules, None),
        "nothing says they are alike"
    );
}

#[test]
fn a_summary_needs_every_episode_once() {
    let mut outcomes = outcomes(3, |_, _| true);
    outcomes.reverse();
    EpisodeSummary::of(&outcomes, &Default::default()).unwrap();
    let first = outcomes.remove(2); // prepare 0
    assert_eq!(
        EpisodeSummary::of(&outcomes, &Default::default()),
        Err(PairingError::Missing(Task::Prepare, 0))
    );
    outcomes.extend([first.clone(), first]);
    assert_eq!(
        EpisodeSummary::of(&outcomes, &Default::default()),
        Err(PairingError::Repeated(Task::Prepare, 0))
    );
    assert_eq!(summary(&[]).tier_change, 0.0);
}

#[test]
fn a_summary_survives_being_stored() {
    let mut outcomes = outcomes(50, |_, e| e % 3 == 0);
    for outcome in &mut outcomes[..8] {
        outcome.violations = Violations {
            ee: true,
            ..Violations::default()
        };
    }
    let summary = summary(&outcomes);
    assert!(summary.tasks[&Task::Hit].tier_change > 0.2);
    assert_eq!(summary.tasks[&Task::Defend].tier_change, 0.0);
    let json = serde_json::to_string(&summary).unwrap();
    assert_eq!(
        serde_json::from_str::<EpisodeSummary>(&json).unwrap(),
        summary
    );
}

proptest! {
    /// The bits and the outcomes tell the same: counts, tests and scores.
    #[test]
    fn the_summary_pairs_as_the_outcomes_do(
        a in prop::collection::vec(any::<bool>(), 1..200),
        seed in any::<u64>(),
    ) {
        let n = a.len() as u32;
        let of_a = outcomes(n, |_, e| a[e as usize]);
        let of_b = outcomes(n, |task, e| (seed >> (e % 61)) & 1 == u64::from(task == Task::Hit));
        let comparison = played(&summary(&of_a)).compare(&played(&summary(&of_b))).unwrap();
        let tallies: BTreeMap<Task, PairedTally> = Task::ALL
            .into_iter()
            .map(|task| {
                let mut tally = PairedTally::default();
                for (a, b) in of_a.iter().zip(&of_b).filter(|(a, _)| a.task == task) {
                    *match (a.success, b.success) {
                        (true, true) => &mut tally.both,
                        (true, false) => &mut tally.only_a,
                        (false, true) => &mut tally.only_b,
                        (false, false) => &mut tally.neither,
                    } += 1;
                }
                (task, tally)
            })
            .collect();
        for (task, tally) in &tallies {
            let got = &comparison.tasks[task];
            prop_assert_eq!(tally.both, got.both);
            prop_assert_eq!((tally.only_a, tally.only_b), (got.only_a, got.only_b));
            prop_assert_eq!(tally.p_value(), got.p_value);
            let [low, high] = got.difference_ci95;
            prop_assert!(-1.0 <= low && low <= got.difference + 1e-12);
            prop_assert!(got.difference <= high + 1e-12 && high <= 1.0);
        }
        prop_assert_eq!(comparison.overall.p_value, overall_p_value(&Default::default(), &tallies));
        let score = |all: &[EpisodeOutcome]| overall_score(&Default::default(), Task::ALL.map(|task| {
            let of_task: Vec<_> = all.iter().filter(|o| o.task == task).cloned().collect();
            (task, score_task(&of_task, &StepTimes::default(), &Default::default()).success_rate)
        }));
        prop_assert_eq!(comparison.overall.score_a, score(&of_a));
        prop_assert_eq!(comparison.overall.score_b, score(&of_b));
    }
}

//! Tests of comparisons of two evaluations, and of the summaries that they need.

use crate::support::{bounds, episode, weights};
use faceoff_airhockey::{DEFEND, EE, EVALUATION, HIT, IDEAL, JOINT_VEL, PREPARE, TASKS};
use faceoff_scoring::{
    ComparedEvaluation, EpisodeSummary, NotComparable, PairedTally, PairingError, StepTimes,
    overall_p_value, overall_score, score_task,
};
use faceoff_types::{EpisodeOutcome, Magnitude, Seed, Task, TaskMap, TaskWeights, Variation};
use proptest::prelude::*;
use std::sync::LazyLock;

/// `episodes` outcomes for each task; `solved` selects the successes.
fn outcomes(episodes: u32, solved: impl Fn(Task, u32) -> bool) -> Vec<EpisodeOutcome> {
    let solved = &solved;
    TASKS
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
    EpisodeSummary::from_outcomes(
        &faceoff_airhockey::competition(),
        outcomes,
        &TASKS,
        bounds(),
    )
    .unwrap()
}

fn evaluation(summary: &EpisodeSummary) -> ComparedEvaluation<'_> {
    ComparedEvaluation {
        ruleset: "airhockey-2023.3",
        profile: EVALUATION,
        variation: &NO_VARIATION,
        weights: &WEIGHTS,
        seed: Seed::from_number(1),
        mismatch_seed: Seed::from_number(2),
        summary,
    }
}

/// The weights of the ruleset.
static WEIGHTS: LazyLock<TaskWeights> = LazyLock::new(weights);
/// No deviation from the ruleset.
static NO_VARIATION: LazyLock<Variation> = LazyLock::new(Variation::default);

#[test]
fn comparison_uses_variation_and_refuses_different_ones() {
    let a = summary(&outcomes(100, |task, episode| match task {
        HIT => episode < 80,
        _ => episode < 50,
    }));
    let b = summary(&outcomes(100, |task, episode| match task {
        PREPARE => episode < 99,
        _ => episode < 50,
    }));
    let with_weights = |weights: &str| Variation {
        weights: Some(TaskWeights::parse(weights, TASKS.into_iter()).unwrap()),
        ..Variation::default()
    };
    let score = |variation: &Variation| {
        let weights = faceoff_airhockey::competition().weights(variation);
        let evaluation_of = |summary| ComparedEvaluation {
            variation,
            weights: &weights,
            ..evaluation(summary)
        };
        let compared = evaluation_of(&a).compare(&evaluation_of(&b)).unwrap();
        (
            compared.overall.score_a,
            compared.overall.score_b,
            compared.overall.significant,
        )
    };
    assert_eq!(score(&with_weights("1,0,0")), (80.0, 50.0, true));
    assert_eq!(score(&with_weights("0,0,1")), (50.0, 99.0, true));
    assert_eq!(score(&with_weights("0,1,0")), (50.0, 50.0, false));
    // A task with weight 0 has its own board, too.
    let no_hit = with_weights("0,1,0");
    let no_hit_weights = TaskWeights::of(DEFEND);
    let evaluation_of = |summary| ComparedEvaluation {
        variation: &no_hit,
        weights: &no_hit_weights,
        ..evaluation(summary)
    };
    assert!(evaluation_of(&a).differs_significantly(&evaluation_of(&b), Some(HIT)));
    assert!(!evaluation_of(&a).differs_significantly(&evaluation_of(&b), None));

    let mut without_losses = Variation::default();
    let never = Magnitude::Number(0.0);
    without_losses
        .perturbations
        .set("tracking_loss", "probability", never);
    let other_bounds = Variation {
        tier_bounds: Some("0.1,0.2".parse().unwrap()),
        ..Variation::default()
    };
    for (other, field) in [
        (with_weights("1,0,0"), "weights"),
        (other_bounds, "tier_bounds"),
        (without_losses, "perturbations"),
    ] {
        let other = ComparedEvaluation {
            variation: &other,
            ..evaluation(&a)
        };
        let refused = evaluation(&a).compare(&other).unwrap_err();
        assert_eq!(refused, NotComparable::Variation(field));
        assert_eq!(refused.field(), field);
        assert!(evaluation(&a).differs_significantly(&other, None));
    }
}

#[test]
fn tier_change_depends_on_bounds() {
    let all = outcomes(100, |_, _| true);
    let costly: Vec<_> = all
        .into_iter()
        .map(|outcome| EpisodeOutcome {
            violations: [(JOINT_VEL, outcome.episode < 10)].into_iter().collect(),
            ..outcome
        })
        .collect();
    let clear =
        EpisodeSummary::from_outcomes(&faceoff_airhockey::competition(), &costly, &TASKS, bounds())
            .unwrap();
    assert_eq!(
        clear.tier_change,
        Some(0.0),
        "10 points in each task, deployable up to 50"
    );
    let tight = EpisodeSummary::from_outcomes(
        &faceoff_airhockey::competition(),
        &costly,
        &TASKS,
        Some("0.1,0.5".parse().unwrap()),
    )
    .unwrap();
    assert!(
        tight.tier_change.unwrap() > 0.5,
        "10 points in each of three tasks, deployable up to 10: {:?}",
        tight.tier_change
    );
    let without =
        EpisodeSummary::from_outcomes(&faceoff_airhockey::competition(), &costly, &TASKS, None)
            .unwrap();
    assert_eq!(without.tier_change_of(None), None);
    assert_eq!(without.tier_change_of(Some(HIT)), None);
    let json = serde_json::to_string(&without).unwrap();
    assert!(!json.contains("tier"), "{json}");
}

#[test]
fn comparison_has_counts_intervals_and_p_values() {
    let a = summary(&outcomes(100, |task, episode| match task {
        HIT => episode < 60,
        DEFEND => episode % 2 == 0,
        _ => true,
    }));
    let b = summary(&outcomes(100, |task, episode| match task {
        HIT => (20..50).contains(&episode),
        DEFEND => episode % 2 == 0,
        _ => episode > 0,
    }));
    let comparison = evaluation(&a).compare(&evaluation(&b)).unwrap();
    let hit = &comparison.tasks[&HIT];
    assert_eq!(
        (hit.both, hit.only_a, hit.only_b, hit.neither),
        (30, 30, 0, 40)
    );
    assert_eq!((hit.success_rate_a, hit.success_rate_b), (0.6, 0.3));
    assert!((hit.difference - 0.3).abs() < 1e-12);
    assert!(hit.p_value < 1e-8 && hit.significant);
    let [low, high] = hit.difference_ci95;
    assert!(
        0.2 < low && low < 0.3 && 0.3 < high && high < 0.4,
        "{hit:?}"
    );
    let defend = &comparison.tasks[&DEFEND];
    assert_eq!((defend.difference, defend.p_value), (0.0, 1.0));
    assert!(defend.difference_ci95[0] < 0.0 && defend.difference_ci95[1] > 0.0);
    assert!(!comparison.tasks[&PREPARE].significant);
    let overall = &comparison.overall;
    assert_eq!((overall.score_a, overall.score_b), (64.0, 51.8));
    assert!((overall.difference - 12.2).abs() < 1e-9);
    assert!(overall.significant && overall.difference_ci95[0] > 0.0);
}

#[test]
fn comparison_error_names_differing_field() {
    let all = summary(&outcomes(4, |_, _| true));
    let longer = summary(&outcomes(5, |_, _| true));
    let mut hit_alone = outcomes(4, |_, _| true);
    hit_alone.retain(|outcome| outcome.task == HIT);
    let hit_alone = summary(&hit_alone);
    let a = evaluation(&all);
    let refused = [
        (
            ComparedEvaluation {
                ruleset: "other",
                ..a
            },
            "ruleset",
        ),
        (
            ComparedEvaluation {
                profile: IDEAL,
                ..a
            },
            "profile",
        ),
        (
            ComparedEvaluation {
                seed: Seed::from_number(9),
                ..a
            },
            "seed",
        ),
        (
            ComparedEvaluation {
                mismatch_seed: Seed::from_number(9),
                ..a
            },
            "mismatch_seed",
        ),
        (evaluation(&longer), "episodes"),
        (evaluation(&hit_alone), "tasks"),
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
        a.compare(&evaluation(&hit_alone)),
        Err(NotComparable::Tasks(DEFEND))
    );
}

#[test]
fn unpaired_evaluations_are_compared_by_rates() {
    // Paired, 20 episodes that only one solved are significant; unpaired, 48 % and 50 % of 1000 are not.
    let a = summary(&outcomes(1000, |task, episode| {
        task == HIT && episode < 500
    }));
    let b = summary(&outcomes(1000, |task, episode| {
        task == HIT && episode < 480
    }));
    let c = summary(&outcomes(1000, |task, episode| {
        task == HIT && episode < 400
    }));
    let (first, second) = (evaluation(&a), evaluation(&b));
    assert!(
        first.differs_significantly(&second, None)
            && first.differs_significantly(&second, Some(HIT))
    );
    assert!(!first.differs_significantly(&second, Some(DEFEND)));
    let another_day = |summary| ComparedEvaluation {
        seed: Seed::from_number(9),
        ..evaluation(summary)
    };
    assert!(!first.differs_significantly(&another_day(&b), None));
    assert!(first.differs_significantly(&another_day(&c), None));
    assert!(first.differs_significantly(&another_day(&c), Some(HIT)));
    let other_rules = ComparedEvaluation {
        ruleset: "other",
        ..first
    };
    assert!(
        first.differs_significantly(&other_rules, None),
        "evaluations under different rules are never statistically tied"
    );
}

#[test]
fn summary_needs_each_episode_once() {
    let mut outcomes = outcomes(3, |_, _| true);
    outcomes.reverse();
    EpisodeSummary::from_outcomes(
        &faceoff_airhockey::competition(),
        &outcomes,
        &TASKS,
        bounds(),
    )
    .unwrap();
    let first = outcomes.remove(2); // prepare 0
    assert_eq!(
        EpisodeSummary::from_outcomes(
            &faceoff_airhockey::competition(),
            &outcomes,
            &TASKS,
            bounds()
        ),
        Err(PairingError::Missing(PREPARE, 0))
    );
    outcomes.extend([first.clone(), first]);
    assert_eq!(
        EpisodeSummary::from_outcomes(
            &faceoff_airhockey::competition(),
            &outcomes,
            &TASKS,
            bounds()
        ),
        Err(PairingError::Repeated(PREPARE, 0))
    );
    assert_eq!(summary(&[]).tier_change, Some(0.0));
}

#[test]
fn summary_round_trips_as_json() {
    let mut outcomes = outcomes(50, |_, episode| episode % 3 == 0);
    for outcome in &mut outcomes[..8] {
        outcome.violations = [(EE, true)].into_iter().collect();
    }
    let summary = summary(&outcomes);
    assert!(summary.tasks[&HIT].tier_change.unwrap() > 0.2);
    assert_eq!(summary.tasks[&DEFEND].tier_change, Some(0.0));
    let json = serde_json::to_string(&summary).unwrap();
    assert_eq!(
        serde_json::from_str::<EpisodeSummary>(&json).unwrap(),
        summary
    );
}

proptest! {
    /// Comparisons of summaries and of outcomes agree in counts, tests and scores.
    #[test]
    fn summary_comparison_equals_that_of_outcomes(
        a in prop::collection::vec(any::<bool>(), 1..200),
        seed in any::<u64>(),
    ) {
        let episodes = a.len() as u32;
        let outcomes_a = outcomes(episodes, |_, episode| a[episode as usize]);
        // The bits of the seed decide which episodes B solves.
        let outcomes_b = outcomes(episodes, |task, episode| (seed >> (episode % 61)) & 1 == u64::from(task == HIT));
        let comparison = evaluation(&summary(&outcomes_a)).compare(&evaluation(&summary(&outcomes_b))).unwrap();
        let tallies: TaskMap<PairedTally> = TASKS
            .into_iter()
            .map(|task| {
                let mut tally = PairedTally::default();
                for (a, b) in outcomes_a.iter().zip(&outcomes_b).filter(|(a, _)| a.task == task) {
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
        prop_assert_eq!(comparison.overall.p_value, overall_p_value(&WEIGHTS, &tallies));
        let score = |all: &[EpisodeOutcome]| overall_score(&WEIGHTS, TASKS.map(|task| {
            let task_outcomes: Vec<_> = all.iter().filter(|outcome| outcome.task == task).cloned().collect();
            (task, score_task(&faceoff_airhockey::competition(), &task_outcomes, &StepTimes::default(), bounds()).success_rate)
        }));
        prop_assert_eq!(comparison.overall.score_a, score(&outcomes_a));
        prop_assert_eq!(comparison.overall.score_b, score(&outcomes_b));
    }
}

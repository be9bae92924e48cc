//! The ablation: how much each *profile* (set of perturbations, such as noise or loss of the puck) lowers an agent's success
//! rate, compared with the *ideal* profile, which has no perturbations.

use crate::{
    interval::wilson95,
    paired_tests::{PairedTally, PairingError},
    summary::{EpisodeSummary, TaskSummary},
};
use faceoff_types::{Profile, ProfileMap, Task, TaskMap};
use serde::{Deserialize, Serialize};
use std::borrow::Borrow;

/// Results of an agent in one task under one profile, compared with the ideal profile on the same episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ProfileEffect {
    /// The profile that is compared with the ideal one.
    pub profile: Profile,
    /// Episodes simulated under each of the two profiles.
    pub episodes: u32,
    /// Episodes that ended in success.
    pub successes: u32,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub success_ci95: [f64; 2],
    /// Penalty points over all episodes.
    pub penalty_points: f64,
    /// The success rate minus that of the ideal profile, as a fraction.
    pub difference: f64,
    /// Episodes that succeed in the ideal profile only.
    pub lost: u32,
    /// Episodes that succeed in this profile only.
    pub gained: u32,
    /// McNemar's exact test of this profile against the ideal one, two-sided.
    pub p_value: f64,
}

/// Compares each profile with the ideal one, task by task, on paired episodes: the table of the ablation figure
/// in the paper on the 2023 Robot Air Hockey Challenge. `runs` has the agent's episodes under each profile, in whose order the result is.
/// Tasks without episodes under the ideal profile are left out.
///
/// The caller ensures that all runs have the same seed.
///
/// # Errors
/// If a profile has more or fewer episodes than the ideal one.
pub fn ablation(
    runs: &ProfileMap<impl Borrow<EpisodeSummary>>,
    ideal: Profile,
) -> Result<TaskMap<Vec<ProfileEffect>>, PairingError> {
    let Some(ideal) = runs.get(&ideal) else {
        return Ok(TaskMap::new());
    };
    let effects_of = |(task, ideal): (&Task, &TaskSummary)| {
        let effects = runs.iter().map(|(profile, run)| {
            let summary = run.borrow().tasks.get(task);
            let summary = summary.ok_or(PairingError::Unpaired(*task, 0))?;
            let tally = PairedTally::from_successes(*task, &ideal.successes, &summary.successes)?;
            Ok(effect(*profile, &tally, summary.penalty_points))
        });
        Ok((*task, effects.collect::<Result<_, _>>()?))
    };
    ideal.borrow().tasks.iter().map(effects_of).collect()
}

/// The effect of `profile`. In `tally`, A is the ideal profile and B is `profile`.
fn effect(profile: Profile, tally: &PairedTally, penalty_points: f64) -> ProfileEffect {
    let (episodes, successes) = (tally.episodes(), tally.both + tally.only_b);
    let rate = |successes: u32| f64::from(successes) / f64::from(episodes);
    ProfileEffect {
        profile,
        episodes,
        successes,
        success_rate: rate(successes),
        success_ci95: wilson95(successes, episodes),
        penalty_points,
        difference: rate(successes) - rate(tally.both + tally.only_a),
        lost: tally.only_a,
        gained: tally.only_b,
        p_value: tally.p_value(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_airhockey::{DEFEND, EE, EVALUATION, HIT, IDEAL, PREPARE, TASKS, TRACKING_LOSS};
    use faceoff_types::{ComputationTime, EpisodeEnd, EpisodeOutcome};

    fn summary(outcomes: &[EpisodeOutcome]) -> EpisodeSummary {
        EpisodeSummary::from_outcomes(
            &faceoff_airhockey::competition(),
            outcomes,
            &TASKS,
            Some(crate::TIER_BOUNDS),
        )
        .unwrap()
    }

    /// Outcomes with these successes; each failed episode has the 3 penalty points of an end effector violation.
    fn run(task: Task, successes: &[bool]) -> Vec<EpisodeOutcome> {
        (0..)
            .zip(successes)
            .map(|(episode, success)| EpisodeOutcome {
                task,
                episode,
                steps: 1,
                end: EpisodeEnd::HORIZON,
                success: *success,
                violations: [(EE, !success)].into_iter().collect(),
                computation_time: ComputationTime::default(),
                fault: None,
            })
            .collect()
    }

    #[test]
    fn profile_is_compared_with_ideal_on_same_episodes() {
        let mut ideal = run(HIT, &[true; 8]);
        ideal.extend(run(PREPARE, &[true, false]));
        let mut tracking_loss = run(HIT, &[false, false, false, false, false, false, true, true]);
        tracking_loss.extend(run(PREPARE, &[false, true]));
        let runs = ProfileMap::from([
            (IDEAL, summary(&ideal)),
            (TRACKING_LOSS, summary(&tracking_loss)),
        ]);
        let tasks = ablation(&runs, IDEAL).unwrap();
        assert_eq!(tasks.keys().collect::<Vec<_>>(), [&HIT, &PREPARE]);
        let [ideal, loss] = &tasks[&HIT][..] else {
            panic!("two profiles")
        };
        assert_eq!(
            (ideal.profile, ideal.difference, ideal.p_value),
            (IDEAL, 0.0, 1.0)
        );
        assert_eq!(loss.profile, TRACKING_LOSS);
        assert_eq!(
            (loss.episodes, loss.successes, loss.success_rate),
            (8, 2, 0.25)
        );
        assert_eq!((loss.lost, loss.gained, loss.difference), (6, 0, -0.75));
        assert_eq!(loss.p_value, 2.0 / 64.0);
        assert_eq!(loss.penalty_points, 18.0);
        assert_eq!(loss.success_ci95, wilson95(2, 8));
        let prepare = &tasks[&PREPARE][1];
        assert_eq!((prepare.lost, prepare.gained, prepare.p_value), (1, 1, 1.0));
    }

    #[test]
    fn runs_with_different_episodes_are_refused() {
        let runs = ProfileMap::from([
            (IDEAL, summary(&run(HIT, &[true, true]))),
            (EVALUATION, summary(&run(HIT, &[true]))),
        ]);
        let unpaired = |task, episode| Err(PairingError::Unpaired(task, episode));
        assert_eq!(ablation(&runs, IDEAL), unpaired(HIT, 1));
        let other_task = summary(&run(DEFEND, &[true, true]));
        let runs = ProfileMap::from([(IDEAL, runs[&IDEAL].clone()), (EVALUATION, other_task)]);
        assert_eq!(ablation(&runs, IDEAL), unpaired(HIT, 0));
        let no_runs = ProfileMap::<EpisodeSummary>::new();
        assert!(ablation(&no_runs, IDEAL).unwrap().is_empty());
    }
}

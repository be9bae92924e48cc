use crate::{PairedTally, PairingError, episode_penalty, wilson95};
use faceoff_types::{EpisodeOutcome, Profile, Task};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How an agent did in one task under one profile, beside the ideal one on the same episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProfileEffect {
    /// The perturbations.
    pub profile: Profile,
    /// Episodes played.
    pub episodes: u32,
    /// Episodes that ended in success.
    pub successes: u32,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    pub success_ci95: [f64; 2],
    /// Penalty points over all episodes.
    pub penalty_points: f64,
    /// The success rate less the ideal profile's, as a fraction.
    pub difference: f64,
    /// Episodes that succeed in the ideal profile only.
    pub lost: u32,
    /// Episodes that succeed in this profile only.
    pub gained: u32,
    /// McNemar's exact test of this profile against the ideal one, two-sided.
    pub p_value: f64,
}

/// Compares each profile with the ideal one, task by task, on paired episodes: the table behind the
/// paper's ablation figure. Profiles come in their own order; tasks without an ideal run are left out.
///
/// The caller sees to it that all runs come from one seed.
///
/// # Errors
/// If a profile did not play exactly the episodes of the ideal one, each once.
pub fn ablation(
    runs: &BTreeMap<Profile, Vec<EpisodeOutcome>>,
) -> Result<BTreeMap<Task, Vec<ProfileEffect>>, PairingError> {
    let mut tasks = BTreeMap::new();
    for task in Task::ALL {
        let of_task = |outcomes: &[EpisodeOutcome]| -> Vec<EpisodeOutcome> {
            let of_task = outcomes.iter().filter(|outcome| outcome.task == task);
            of_task.cloned().collect()
        };
        let ideal = runs.get(&Profile::Ideal).map(|all| of_task(all));
        let Some(ideal) = ideal.filter(|ideal| !ideal.is_empty()) else {
            continue;
        };
        let effects = runs
            .iter()
            .map(|(profile, outcomes)| effect(*profile, &ideal, &of_task(outcomes)))
            .collect::<Result<Vec<_>, _>>()?;
        tasks.insert(task, effects);
    }
    Ok(tasks)
}

fn effect(
    profile: Profile,
    ideal: &[EpisodeOutcome],
    outcomes: &[EpisodeOutcome],
) -> Result<ProfileEffect, PairingError> {
    let tally = PairedTally::of(ideal, outcomes)?;
    let (episodes, successes) = (tally.episodes(), tally.both + tally.only_b);
    let rate = |successes: u32| f64::from(successes) / f64::from(episodes);
    Ok(ProfileEffect {
        profile,
        episodes,
        successes,
        success_rate: rate(successes),
        success_ci95: wilson95(successes, episodes),
        penalty_points: outcomes.iter().map(episode_penalty).sum(),
        difference: rate(successes) - rate(tally.both + tally.only_a),
        lost: tally.only_a,
        gained: tally.only_b,
        p_value: tally.p_value(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::{ComputationTime, EpisodeEnd, Violations};

    fn run(task: Task, successes: &[bool]) -> Vec<EpisodeOutcome> {
        (0..)
            .zip(successes)
            .map(|(episode, success)| EpisodeOutcome {
                task,
                episode,
                steps: 1,
                end: EpisodeEnd::Horizon,
                success: *success,
                violations: Violations {
                    ee: !success,
                    ..Violations::default()
                },
                computation_time: ComputationTime::default(),
                fault: None,
            })
            .collect()
    }

    #[test]
    fn a_factor_is_compared_with_the_ideal_on_the_same_episodes() {
        let mut ideal = run(Task::Hit, &[true; 8]);
        ideal.extend(run(Task::Prepare, &[true, false]));
        let mut lost = run(
            Task::Hit,
            &[false, false, false, false, false, false, true, true],
        );
        lost.extend(run(Task::Prepare, &[false, true]));
        let runs = BTreeMap::from([(Profile::TrackingLoss, lost), (Profile::Ideal, ideal)]);
        let tasks = ablation(&runs).unwrap();
        assert_eq!(
            tasks.keys().collect::<Vec<_>>(),
            [&Task::Hit, &Task::Prepare]
        );
        let [ideal, loss] = &tasks[&Task::Hit][..] else {
            panic!("two profiles")
        };
        assert_eq!(
            (ideal.profile, ideal.difference, ideal.p_value),
            (Profile::Ideal, 0.0, 1.0)
        );
        assert_eq!(loss.profile, Profile::TrackingLoss);
        assert_eq!(
            (loss.episodes, loss.successes, loss.success_rate),
            (8, 2, 0.25)
        );
        assert_eq!((loss.lost, loss.gained, loss.difference), (6, 0, -0.75));
        assert_eq!(loss.p_value, 2.0 / 64.0);
        assert_eq!(loss.penalty_points, 18.0);
        assert_eq!(loss.success_ci95, wilson95(2, 8));
        let prepare = &tasks[&Task::Prepare][1];
        assert_eq!((prepare.lost, prepare.gained, prepare.p_value), (1, 1, 1.0));
    }

    #[test]
    fn runs_of_different_episodes_are_refused() {
        let runs = BTreeMap::from([
            (Profile::Ideal, run(Task::Hit, &[true, true])),
            (Profile::Evaluation, run(Task::Hit, &[true])),
        ]);
        assert!(ablation(&runs).is_err());
        assert!(ablation(&BTreeMap::new()).unwrap().is_empty());
    }
}

//! The three tasks: few episodes must roughly agree with the success rates in the README.

use baseline::Baseline;
use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant};
use faceoff_types::{Profile, Seed, Task};
use striker::Policy;

use crate::support::env::env;

const EPISODES: u32 = 30;

/// Successes in the first episodes of a season.
fn count_successes(task: Task, agent_task: striker::Task) -> u32 {
    let season = Seed::from_number(101);
    let settings = PerturbationSettings::default();
    let factors = Profile::Evaluation.factors();
    let plant = Plant::for_factors(factors, &settings, season.model_mismatch());
    let mut agent = Baseline::new(agent_task, &env(2, 0));
    let mut successes = 0;
    for index in 0..EPISODES {
        let seed = season.episode(task, index);
        let mut episode =
            Episode::new(task, Interpolation::Cubic, factors, &settings, &plant, seed);
        agent.reset();
        loop {
            let action = agent
                .act(episode.observation())
                .expect("an observation of the documented length");
            if episode.step(action.as_flattened()).end.is_some() {
                break;
            }
        }
        successes += u32::from(episode.success());
    }
    successes
}

#[test]
fn hit_succeeds_sometimes() {
    let successes = count_successes(Task::Hit, striker::Task::Hit);
    assert!((1..=10).contains(&successes), "{successes} of {EPISODES}");
}

#[test]
fn defend_stops_about_a_quarter() {
    let successes = count_successes(Task::Defend, striker::Task::Defend);
    assert!((3..=15).contains(&successes), "{successes} of {EPISODES}");
}

#[test]
fn prepare_frees_most_pucks() {
    let successes = count_successes(Task::Prepare, striker::Task::Prepare);
    assert!((13..=25).contains(&successes), "{successes} of {EPISODES}");
}

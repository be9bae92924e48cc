//! The baseline's successes in a few episodes of each task, which must roughly agree with the success rates in the README.

use baseline::Baseline;
use faceoff_sim::{
    AirHockeyProfile, AirHockeyTask, Episode, Interpolation, PerturbationSettings, Plant,
};
use faceoff_types::Seed;
use striker::Policy;

use crate::support::env::env;

const EPISODES: u32 = 30;
/// The first season of the README's table.
const SEASON_SEED: u64 = 101;

/// Successes in the first episodes of a season (one draw of the arm's model mismatch). `agent_task` is the same task as `task`, in the
/// agent's type.
fn count_successes(task: AirHockeyTask, agent_task: striker::Task) -> u32 {
    let season = Seed::from_number(SEASON_SEED);
    let settings = PerturbationSettings::default();
    let active_perturbations = AirHockeyProfile::Evaluation.active_perturbations();
    let plant = Plant::for_perturbations(active_perturbations, &settings, season.model_mismatch());
    let (robots, robot_index) = (2, 0);
    let mut agent = Baseline::new(agent_task, &env(robots, robot_index));
    let mut successes = 0;
    for index in 0..EPISODES {
        let seed = season.episode(task, index);
        let mut episode = Episode::new(
            task,
            Interpolation::Cubic,
            active_perturbations,
            &settings,
            &plant,
            seed,
        );
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
fn hit_succeeds_in_up_to_a_third() {
    let successes = count_successes(AirHockeyTask::Hit, striker::Task::Hit);
    assert!((1..=10).contains(&successes), "{successes} of {EPISODES}");
}

#[test]
fn defend_stops_about_a_quarter_of_pucks() {
    let successes = count_successes(AirHockeyTask::Defend, striker::Task::Defend);
    assert!((3..=15).contains(&successes), "{successes} of {EPISODES}");
}

#[test]
fn prepare_frees_most_pucks() {
    let successes = count_successes(AirHockeyTask::Prepare, striker::Task::Prepare);
    assert!((13..=25).contains(&successes), "{successes} of {EPISODES}");
}

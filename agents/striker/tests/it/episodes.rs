//! The agent's successes and penalty points in whole simulated episodes under all perturbations, with fixed seeds.

use faceoff_sim::{
    AirHockeyProfile, AirHockeyTask, Episode, Interpolation, PerturbationSettings, Plant,
};
use faceoff_types::Seed;
use striker::{Agent, Policy};

use crate::support::env::env;

const EPISODES: u32 = 12;
const SEASON_SEED: u64 = 2023;

/// Successes and penalty points of the first episodes of a season (one draw of the arm's model mismatch).
fn play(task: AirHockeyTask) -> (u32, u32) {
    let season = Seed::from_number(SEASON_SEED);
    let settings = PerturbationSettings::default();
    let plant = Plant::mismatched(&settings, season.model_mismatch());
    let mut agent = agent(task);
    let (mut successes, mut points) = (0, 0);
    for index in 0..EPISODES {
        let seed = season.episode(task, index);
        let active_perturbations = AirHockeyProfile::Evaluation.active_perturbations();
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
        let violations = episode.violations();
        successes += u32::from(episode.success());
        points += 3 * u32::from(violations.ee)
            + 3 * u32::from(violations.link)
            + 2 * u32::from(violations.joint_pos)
            + u32::from(violations.joint_vel);
    }
    (successes, points)
}

fn agent(task: AirHockeyTask) -> Agent {
    let task = match task {
        AirHockeyTask::Hit => striker::Task::Hit,
        AirHockeyTask::Defend => striker::Task::Defend,
        AirHockeyTask::Prepare => striker::Task::Prepare,
    };
    let (robots, robot_index) = (1, 0);
    Agent::new(task, &env(robots, robot_index))
}

/// Penalty points up to which the rules call an agent *deployable*: half a point per episode.
const DEPLOYABLE_POINTS_MAX: u32 = EPISODES / 2;

#[test]
fn hit_scores_and_stays_deployable() {
    let (successes, points) = play(AirHockeyTask::Hit);
    assert!(
        successes >= 2 && points <= DEPLOYABLE_POINTS_MAX,
        "{successes} goals, {points} points"
    );
}

#[test]
fn defend_succeeds_and_stays_deployable() {
    let (successes, points) = play(AirHockeyTask::Defend);
    assert!(
        successes >= 6 && points <= DEPLOYABLE_POINTS_MAX,
        "{successes} stopped, {points} points"
    );
}

#[test]
fn prepare_succeeds_and_stays_deployable() {
    let (successes, points) = play(AirHockeyTask::Prepare);
    assert!(
        successes >= 7 && points <= DEPLOYABLE_POINTS_MAX,
        "{successes} freed, {points} points"
    );
}

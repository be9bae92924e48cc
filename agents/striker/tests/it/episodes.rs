//! Whole episodes in the simulator under all perturbations, with fixed seeds.

use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant, env_info};
use faceoff_types::{Profile, Seed, Task};
use striker::{Agent, BaseFrame, Env, RadiusInfo, RobotInfo, TableInfo};

const EPISODES: u32 = 12;

/// Successes and penalty points of the first episodes of a season.
fn play(task: Task) -> (u32, u32) {
    let season = Seed::from_number(2023);
    let settings = PerturbationSettings::default();
    let plant = Plant::mismatched(&settings, season.model_mismatch());
    let mut agent = agent(task);
    let (mut successes, mut points) = (0, 0);
    for index in 0..EPISODES {
        let seed = season.episode(task, index);
        let factors = Profile::Evaluation.factors();
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
        let v = episode.violations();
        successes += u32::from(episode.success());
        points += 3 * u32::from(v.ee)
            + 3 * u32::from(v.link)
            + 2 * u32::from(v.joint_pos)
            + u32::from(v.joint_vel);
    }
    (successes, points)
}

fn agent(task: Task) -> Agent {
    let info = env_info(task);
    let env = Env {
        dt: info.dt,
        table: TableInfo {
            length: info.table_length,
            width: info.table_width,
            goal_width: info.goal_width,
        },
        puck: RadiusInfo {
            radius: info.puck_radius,
        },
        mallet: RadiusInfo {
            radius: info.mallet_radius,
        },
        robot: RobotInfo {
            ee_desired_height: info.ee_desired_height,
            joint_pos_limit: info.joint_pos_limit,
            joint_vel_limit: info.joint_vel_limit,
            base_frame: info.base_frame.into_iter().map(BaseFrame::Flat).collect(),
        },
    };
    let task = match task {
        Task::Hit => striker::Task::Hit,
        Task::Defend => striker::Task::Defend,
        Task::Prepare => striker::Task::Prepare,
    };
    Agent::new(task, &env)
}

/// Deployable: at most half a point per episode.
const POINTS_MAX: u32 = EPISODES / 2;

#[test]
fn hit_scores_and_stays_deployable() {
    let (successes, points) = play(Task::Hit);
    assert!(
        successes >= 2 && points <= POINTS_MAX,
        "{successes} goals, {points} points"
    );
}

#[test]
fn defend_scores_and_stays_deployable() {
    let (successes, points) = play(Task::Defend);
    assert!(
        successes >= 6 && points <= POINTS_MAX,
        "{successes} stopped, {points} points"
    );
}

#[test]
fn prepare_scores_and_stays_deployable() {
    let (successes, points) = play(Task::Prepare);
    assert!(
        successes >= 7 && points <= POINTS_MAX,
        "{successes} freed, {points} points"
    );
}

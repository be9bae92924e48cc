//! The same seed gives the same bits on every thread and in a clone, and a robot moves the same with or without a second one. `golden.rs`
//! compares builds.

use crate::still_air::step_in_still_air;
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    AirHockeyProfile, Interpolation, Plant, World,
    golden::{episode_hash, play_episode, scripted_action, start_episode},
    model::INITIAL_Q,
};

#[test]
fn episode_is_the_same_on_any_thread() {
    let alone = play_episode(AirHockeyTask::Hit, AirHockeyProfile::Evaluation);
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4)
            .map(|_| scope.spawn(|| play_episode(AirHockeyTask::Hit, AirHockeyProfile::Evaluation)))
            .collect();
        for run in runs {
            assert_eq!(run.join().unwrap(), alone);
        }
    });
}

#[test]
fn cloned_episode_continues_with_the_same_bits() {
    for task in AirHockeyTask::ALL {
        let mut original = start_episode(task, AirHockeyProfile::Evaluation);
        for _ in 0..20 {
            let action = scripted_action(original.observation(), original.steps());
            original.step(&action);
        }
        assert_eq!(episode_hash(original.clone()), episode_hash(original));
    }
}

#[test]
fn arm_moves_the_same_alone_and_with_a_second_arm() {
    let plant = Plant::nominal();
    let puck_out_of_reach = [0.0, 0.4, 0.0, 0.0, 0.0, 0.0];
    let mut alone = World::with_robots(&plant, 1, puck_out_of_reach);
    let mut together = World::with_robots(&plant, 2, puck_out_of_reach);
    for step in 0..50 {
        let mut action = [0.0; 14];
        action[..7].copy_from_slice(&INITIAL_Q);
        action[0] = 0.005 * f64::from(step);
        alone.command(0, Interpolation::Cubic, &action);
        for robot in 0..2 {
            together.command(robot, Interpolation::Cubic, &action);
        }
        step_in_still_air(&mut alone);
        step_in_still_air(&mut together);
        for robot in 0..2 {
            assert_eq!(alone.joints(0), together.joints(robot));
            assert_eq!(alone.joint_velocities(0), together.joint_velocities(robot));
            assert_eq!(alone.universal(0), together.universal(robot));
        }
    }
}

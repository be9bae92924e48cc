//! The same seed, the same bits: on every machine, in every build, after every restore.

use crate::policy::strike;
use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant, World, model::INITIAL_Q};
use faceoff_types::{Factors, Seed, Task};

fn episode(task: Task, factors: Factors) -> Episode {
    let settings = PerturbationSettings::default();
    let root = Seed::from_number(1);
    let plant = Plant::under(factors, &settings, root.model_mismatch());
    Episode::new(
        task,
        Interpolation::Cubic,
        factors,
        &settings,
        &plant,
        root.episode(task, 0),
    )
}

/// Hash of every state and observation of an episode.
fn hash(mut episode: Episode) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut add = |numbers: &[f64]| {
        for number in numbers {
            hasher.update(&number.to_le_bytes());
        }
    };
    loop {
        add(episode.observation());
        let action = strike(episode.observation(), episode.steps());
        let outcome = episode.step(&action);
        let state = episode.state();
        add(&state.puck);
        add(&state.q);
        add(&state.dq);
        add(&state.universal);
        add(&state.opponent_q.unwrap_or_default());
        if outcome.end.is_some() {
            break;
        }
    }
    hasher.finalize().to_hex()[..16].to_owned()
}

/// A change of any of these is a change of the simulator's behaviour, and so of the ruleset.
const GOLDEN: [(Task, Factors, &str); 6] = [
    (Task::Hit, Factors::NONE, "a5ab72f3b76bb29d"),
    (Task::Defend, Factors::NONE, "1d921c0330ed7ed5"),
    (Task::Prepare, Factors::NONE, "1198c6270aff6631"),
    (Task::Hit, Factors::ALL, "29b1cc7af55f2279"),
    (Task::Defend, Factors::ALL, "65fb0180fa976525"),
    (Task::Prepare, Factors::ALL, "3762ed8a388abdba"),
];

#[test]
fn episodes_have_their_golden_hashes() {
    let hashes = GOLDEN.map(|(task, factors, _)| hash(episode(task, factors)));
    let golden = GOLDEN.map(|(_, _, golden)| golden.to_owned());
    assert_eq!(hashes, golden);
}

#[test]
fn threads_do_not_matter() {
    let alone = hash(episode(Task::Hit, Factors::ALL));
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4)
            .map(|_| scope.spawn(|| hash(episode(Task::Hit, Factors::ALL))))
            .collect();
        for run in runs {
            assert_eq!(run.join().unwrap(), alone);
        }
    });
}

#[test]
fn a_saved_episode_continues_as_if_never_stopped() {
    for task in Task::ALL {
        let mut original = episode(task, Factors::ALL);
        for _ in 0..20 {
            let action = strike(original.observation(), original.steps());
            original.step(&action);
        }
        assert_eq!(hash(original.clone()), hash(original));
    }
}

#[test]
fn an_arm_moves_the_same_alone_and_beside_another() {
    let plant = Plant::nominal();
    let far = [0.0, 0.4, 0.0, 0.0, 0.0, 0.0];
    let mut alone = World::with_robots(&plant, 1, far);
    let mut beside = World::with_robots(&plant, 2, far);
    for step in 0..50 {
        let mut action = [0.0; 14];
        action[..7].copy_from_slice(&INITIAL_Q);
        action[0] = 0.005 * f64::from(step);
        alone.command(0, Interpolation::Cubic, &action);
        for robot in 0..2 {
            beside.command(robot, Interpolation::Cubic, &action);
        }
        alone.control_step(|_| [0.0; 2]);
        beside.control_step(|_| [0.0; 2]);
        for robot in 0..2 {
            assert_eq!(alone.joints(0), beside.joints(robot));
            assert_eq!(alone.joint_velocities(0), beside.joint_velocities(robot));
            assert_eq!(alone.universal(0), beside.universal(robot));
        }
    }
}

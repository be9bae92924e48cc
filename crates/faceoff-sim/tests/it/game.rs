//! Games between two agents: goals, fouls and stuck pucks match the recording `game_rules` of the *reference* (the simulator of the
//! 2023 Robot Air Hockey Challenge), and the rules of `docs/rules.md` ("Tournament") hold. A *rally* lasts from a serve to a goal, a foul
//! or another end. Robots are 0 and 1.

use crate::{
    reference::{array, cases, max_difference},
    still_air::step_in_still_air,
};
use faceoff_sim::{
    ActivePerturbations, Command, Game, GameSetup, Interpolation, PerturbationSettings, Plant,
    RallyEnd, ViolatedConstraints, World,
    game::referee::Referee,
    golden::game_hash,
    model::{EE_DESIRED_HEIGHT_M, INITIAL_Q},
};
use faceoff_types::{Seed, WINDOW_STEPS};
use serde_json::Value;

/// Control steps after which a puck that rests on one side is a foul: the first step, and 751 more, which exceed 15 s.
const FOUL_STEPS: u32 = 752;

const CONTROL_STEP_S: f64 = 0.02;

fn setup(active_perturbations: ActivePerturbations, seed: u64) -> GameSetup {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(seed);
    GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        active_perturbations,
        plant: Plant::for_perturbations(active_perturbations, &settings, seed.model_mismatch()),
        settings,
        seed,
    }
}

/// An action that holds the initial position: seven positions, rad, and seven velocities, rad/s.
fn hold() -> [f64; 14] {
    Interpolation::Cubic.hold_position(&INITIAL_Q)[..14]
        .try_into()
        .unwrap()
}

/// Reads a pair of counts.
fn pair(value: &Value) -> [u32; 2] {
    let [a, b]: [f64; 2] = array(value);
    [a as u32, b as u32]
}

/// The robot in whose half a rally starts. In the recording +1 stands for robot 0, −1 for robot 1.
fn serving_robot(value: &Value) -> usize {
    usize::from(value.as_i64() == Some(-1))
}

#[test]
fn goals_fouls_and_stuck_pucks_match_the_recording() {
    for case in cases("game_rules") {
        let name = case["name"].as_str().unwrap();
        // The recording's word for a foul is `fault`.
        let mut referee = Referee::new(serving_robot(&case["start_side_before"]));
        referee.fouls = pair(&case["faults_before"]);
        let score_before = referee.score();
        if let Some(seconds) = case["timer_set"].as_f64() {
            // Here +1 stands for x > 0, the half of robot 1.
            let side = usize::from(case["prev_side_set"].as_i64() == Some(1));
            referee.puck_side = Some((side, (seconds / CONTROL_STEP_S).round() as u32));
        }
        let plant = Plant::nominal();
        let mut world = World::with_robots(&plant, 2, array(&case["puck_before"]));
        step_in_still_air(&mut world);
        let after: [f64; 6] = array(&case["puck_after"]);
        assert!(
            max_difference(&world.puck().state(), &after) <= 1e-6,
            "{name}"
        );

        let end = referee.judge(world.puck());
        assert_eq!(
            end.is_some(),
            case["absorbing"].as_bool().unwrap(),
            "{name}"
        );
        let gained = [0, 1].map(|robot| referee.score()[robot] - score_before[robot]);
        assert_eq!(gained, pair(&case["score"]), "{name}");
        assert_eq!(referee.fouls, pair(&case["faults"]), "{name}");
        let expected = serving_robot(&case["start_side_after"]);
        assert_eq!(referee.serving_robot, expected, "{name}");
        if end.is_none() {
            let steps = referee.puck_side.unwrap().1;
            let timer = case["timer_after"].as_f64().unwrap();
            // The simulator's clock is 0 after a rally's first step, the recording's clock is one step ahead.
            let lead = u32::from(case["timer_set"].is_null());
            assert_eq!(
                steps + lead,
                (timer / CONTROL_STEP_S).round() as u32,
                "{name}"
            );
        }
    }
}

#[test]
fn robots_that_hold_still_foul_in_turn_every_15_s() {
    let mut game = Game::new(setup(ActivePerturbations::NONE, 3));
    let hold = hold();
    let first_robot = game.referee().serving_robot;
    let mut fouls = vec![];
    for step in 1..=6 * FOUL_STEPS {
        let outcome = game.step([Command::Act(&hold); 2]);
        if let Some(end) = outcome.rally_end {
            let RallyEnd::Foul { by } = end else {
                panic!("{end:?}")
            };
            fouls.push((step, by));
        }
    }
    let expected: Vec<_> = (0..6)
        .map(|k| (FOUL_STEPS * (k + 1), (first_robot + k as usize) % 2))
        .collect();
    assert_eq!(fouls, expected);
    assert_eq!(game.referee().fouls, [3, 3]);
    assert_eq!(game.referee().score(), [1, 1]);
    assert_eq!(game.rally(), 6);
}

#[test]
fn rally_starts_at_rest_on_the_serving_side() {
    let hold = hold();
    let mut starts = vec![];
    for seed in 0..40 {
        let mut game = Game::new(setup(ActivePerturbations::NONE, seed));
        for _ in 0..FOUL_STEPS {
            starts.push((
                game.referee().serving_robot,
                game.rally(),
                *game.world().puck(),
            ));
            game.step([Command::Act(&hold); 2]);
        }
        let puck = *game.world().puck();
        let [x, y, _] = puck.pose;
        assert_eq!(game.rally(), 1);
        assert_eq!(usize::from(x > 0.0), game.referee().serving_robot);
        assert!((0.2..=0.7).contains(&x.abs()) && y.abs() <= 0.39105);
        assert_eq!(puck.velocity, [0.0; 3]);
        for robot in 0..2 {
            assert_eq!(game.world().joints(robot), INITIAL_Q);
        }
    }
    let robot_0_serves = starts.iter().filter(|(robot, ..)| *robot == 0).count();
    // Of 40 games, about half start on each side.
    let foul_steps = FOUL_STEPS as usize;
    assert!((5 * foul_steps..35 * foul_steps).contains(&robot_0_serves));
}

#[test]
fn cloned_game_continues_with_the_same_bits() {
    let mut game = Game::new(setup(ActivePerturbations::EVALUATION, 2));
    game_hash(&mut game, 700);
    assert_eq!(game_hash(&mut game.clone(), 900), game_hash(&mut game, 900));
}

#[test]
fn observations_are_symmetric_for_both_robots() {
    // A world, and the same one rotated by half a turn: the robots' observations are swapped.
    let plant = Plant::nominal();
    let puck = [-0.4, 0.2, 0.3, 1.0, -0.5, 2.0];
    let rotated_puck = [0.4, -0.2, 0.3 + std::f64::consts::PI, -1.0, 0.5, 2.0];
    let mut worlds = [puck, rotated_puck].map(|puck| World::with_robots(&plant, 2, puck));
    for step in 0..60 {
        for (k, world) in worlds.iter_mut().enumerate() {
            // Two different motions: the first joint turns to these positions, rad.
            let actions = [0.3, -0.2].map(|target| {
                let mut action = hold();
                action[0] = target * f64::from(step) / 60.0;
                action
            });
            world.command(k, Interpolation::Cubic, &actions[0]);
            world.command(1 - k, Interpolation::Cubic, &actions[1]);
            step_in_still_air(world);
        }
        let observations = [(0, 0), (1, 1)].map(|(world, robot)| {
            faceoff_sim::channel::observation::observe(&worlds[world], robot)
        });
        assert!(
            max_difference(&observations[0], &observations[1]) <= 1e-9,
            "step {step}: {observations:?}"
        );
    }
}

/// A window is 500 steps of a game. Penalty points are counted per window, as they are per episode of a task.
#[test]
fn window_counts_a_violation_once() {
    let mut game = Game::new(setup(ActivePerturbations::NONE, 5));
    // Robot 2 lifts its mallet and keeps it lifted; robot 1 holds still.
    let hold = hold();
    let mut lift = hold;
    let mut windows = vec![];
    for _ in 0..2 * WINDOW_STEPS {
        // The fourth joint lifts the mallet.
        lift[3] = (lift[3] + 0.002).min(INITIAL_Q[3] + 0.15);
        let outcome = game.step([Command::Act(&hold), Command::Act(&lift)]);
        windows.extend(outcome.window);
        if outcome.rally_end.is_some() {
            lift = hold;
        }
    }
    assert_eq!(windows.len(), 2);
    for [first, second] in windows {
        assert_eq!(first, ViolatedConstraints::default());
        let lifted = ViolatedConstraints {
            ee: true,
            ..ViolatedConstraints::default()
        };
        assert_eq!(second, lifted);
    }
}

#[test]
fn late_answer_commands_the_previous_position_at_rest() {
    let mut late = Game::new(setup(ActivePerturbations::NONE, 6));
    let mut held = late.clone();
    let hold = hold();
    let mut moving = hold;
    moving[0] = 0.02; // position of the first joint, rad
    moving[7] = 0.5; // its velocity, rad/s
    let mut stopped = moving;
    stopped[7] = 0.0;
    for game in [&mut late, &mut held] {
        game.step([Command::Act(&moving), Command::Act(&hold)]);
    }
    late.step([Command::Late, Command::Act(&hold)]);
    held.step([Command::Act(&stopped), Command::Act(&hold)]);
    let difference = max_difference(&late.world().joints(0), &held.world().joints(0));
    assert!(difference <= 1e-12, "{difference:e} rad");
    assert!(late.world().joint_velocities(0)[0].abs() > 0.01);
}

#[test]
fn mallets_do_not_pass_through_each_other() {
    let plant = Plant::nominal();
    // The puck lies out of the way.
    let mut world = World::with_robots(&plant, 2, [0.0, -0.45, 0.0, 0.0, 0.0, 0.0]);
    let mut least_distance_m = f64::INFINITY;
    for step in 0..120 {
        let target_x = 0.65 + 0.009 * f64::from(step.min(100));
        for robot in 0..2 {
            let target = [target_x, 0.0, EE_DESIRED_HEIGHT_M];
            let q = faceoff_sim::robot::inverse_kinematics::inverse_kinematics(
                target,
                &world.joints(robot),
            );
            let action = Interpolation::Cubic.hold_position(&q);
            world.command(robot, Interpolation::Cubic, &action[..14]);
        }
        step_in_still_air(&mut world);
        let [a, b] = [0, 1].map(|robot| world.mallet(robot).position);
        least_distance_m = least_distance_m.min((a[0] - b[0]).hypot(a[1] - b[1]));
    }
    // Both are commanded 4 cm beyond the middle, where the mallets would overlap. Their radii are 0.04815 m.
    assert!(
        (0.08..0.0963).contains(&least_distance_m),
        "{least_distance_m} m"
    );
}

#[test]
fn restarted_agent_may_change_its_interpolation() {
    let mut game = Game::new(setup(ActivePerturbations::NONE, 3));
    let hold = hold();
    while game.rally() == 0 {
        game.step([Command::Act(&hold); 2]);
    }
    let mut changed = game.clone();
    changed.set_interpolation(1, Interpolation::Linear);
    // Position alone and position at rest give the same motion, since the arm is at rest already.
    for _ in 0..20 {
        let cubic = game.step([Command::Act(&hold); 2]);
        let linear = changed.step([Command::Act(&hold), Command::Act(&hold[..7])]);
        assert_eq!(cubic.state.q, linear.state.q);
        assert_eq!(linear.state, changed.state());
    }
    // The interpolation also holds in later rallies.
    while changed.rally() == 1 {
        changed.step([Command::Act(&hold), Command::Act(&hold[..7])]);
    }
    changed.step([Command::Act(&hold), Command::Act(&hold[..7])]);
    assert_eq!(changed.world().joints(0), changed.world().joints(1));
}

#[test]
fn game_continued_from_its_progress_has_the_same_bits() {
    let hold = hold();
    let mut game = Game::new(setup(ActivePerturbations::EVALUATION, 5));
    while game.rally() < 2 {
        game.step([Command::Act(&hold); 2]);
    }
    let mut later = Game::at_rally(setup(ActivePerturbations::EVALUATION, 5), &game.progress());
    assert_eq!(later.progress(), game.progress());
    while game.rally() < 4 {
        assert_eq!(later.observation(1), game.observation(1));
        let step = game.step([Command::Act(&hold); 2]);
        assert_eq!(later.step([Command::Act(&hold); 2]), step);
    }
    assert!(game.steps() > 2 * WINDOW_STEPS);
}

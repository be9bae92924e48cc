//! Games between two agents (RULES, "Tournament"; REFERENCE, `game_rules`).

use crate::reference::{array, max_difference, recording};
use faceoff_sim::{
    Command, Game, GameSetup, Interpolation, PerturbationSettings, Plant, RallyEnd, World,
    game::referee::Referee,
    golden::game_hash,
    model::{EE_DESIRED_HEIGHT_M, INITIAL_Q},
};
use faceoff_types::{Factors, Seed, Violations, WINDOW_STEPS};
use serde_json::Value;

fn setup(factors: Factors, seed: u64) -> GameSetup {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(seed);
    GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        factors,
        plant: Plant::for_factors(factors, &settings, seed.model_mismatch()),
        settings,
        seed,
    }
}

fn hold() -> [f64; 14] {
    Interpolation::Cubic.hold_position(&INITIAL_Q)[..14]
        .try_into()
        .unwrap()
}

/// A pair of counts, robot 1's first.
fn pair(value: &Value) -> [u32; 2] {
    let [a, b]: [f64; 2] = array(value);
    [a as u32, b as u32]
}

/// The recording's side: of a start +1 is robot 1's half, of a puck +1 is x > 0.
fn half_of_start(value: &Value) -> usize {
    usize::from(value.as_i64() == Some(-1))
}

#[test]
fn goals_fouls_and_stuck_pucks_match_the_recording() {
    let recording = recording("game_rules");
    for case in recording["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let mut referee = Referee::new(half_of_start(&case["start_side_before"]));
        referee.fouls = pair(&case["faults_before"]);
        let score_before = referee.score();
        if let Some(seconds) = case["timer_set"].as_f64() {
            let half = usize::from(case["prev_side_set"].as_i64() == Some(1));
            referee.puck_side = Some((half, (seconds / 0.02).round() as u32));
        }
        let plant = Plant::nominal();
        let mut world = World::with_robots(&plant, 2, array(&case["puck_before"]));
        world.control_step(|_| [0.0; 2]);
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
        let serves = half_of_start(&case["start_side_after"]);
        assert_eq!(referee.serves, serves, "{name}");
        if end.is_none() {
            let steps = referee.puck_side.unwrap().1;
            let timer = case["timer_after"].as_f64().unwrap();
            // The simulator's clock is 0 after a rally's first step, the recording's clock is one step ahead.
            let first = u32::from(case["timer_set"].is_null());
            assert_eq!(steps + first, (timer / 0.02).round() as u32, "{name}");
        }
    }
}

#[test]
fn robots_that_hold_still_foul_in_turn_every_15_s() {
    let mut game = Game::new(setup(Factors::NONE, 3));
    let hold = hold();
    let first = game.referee().serves;
    let mut fouls = vec![];
    for step in 1..=6 * 752 {
        let outcome = game.step([Command::Act(&hold); 2]);
        if let Some(end) = outcome.rally_end {
            let RallyEnd::Foul { by } = end else {
                panic!("{end:?}")
            };
            fouls.push((step, by));
        }
    }
    // 751 steps beyond the first one are the first to exceed 15 s.
    let expected: Vec<_> = (0..6).map(|k| (752 * (k + 1), (first + k) % 2)).collect();
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
        let mut game = Game::new(setup(Factors::NONE, seed));
        for _ in 0..752 {
            starts.push((game.referee().serves, game.rally(), *game.world().puck()));
            game.step([Command::Act(&hold); 2]);
        }
        let puck = *game.world().puck();
        let [x, y, _] = puck.pose;
        assert_eq!(game.rally(), 1);
        assert_eq!(usize::from(x > 0.0), game.referee().serves);
        assert!((0.2..=0.7).contains(&x.abs()) && y.abs() <= 0.39105);
        assert_eq!(puck.velocity, [0.0; 3]);
        for robot in 0..2 {
            assert_eq!(game.world().joints(robot), INITIAL_Q);
        }
    }
    let first_sides = starts.iter().filter(|(serves, ..)| *serves == 0).count();
    assert!((5 * 752..35 * 752).contains(&first_sides));
}

#[test]
fn saved_game_continues_with_the_same_bits() {
    let mut game = Game::new(setup(Factors::ALL, 2));
    game_hash(&mut game, 700);
    assert_eq!(game_hash(&mut game.clone(), 900), game_hash(&mut game, 900));
}

#[test]
fn observations_are_symmetric_for_both_robots() {
    // A world and its image under half a turn: the robots' observations are swapped.
    let plant = Plant::nominal();
    let world = [-0.4, 0.2, 0.3, 1.0, -0.5, 2.0];
    let image = [0.4, -0.2, 0.3 + std::f64::consts::PI, -1.0, 0.5, 2.0];
    let mut worlds = [world, image].map(|puck| World::with_robots(&plant, 2, puck));
    for step in 0..60 {
        for (k, world) in worlds.iter_mut().enumerate() {
            let actions = [0.3, -0.2].map(|turn| {
                let mut action = hold();
                action[0] = turn * f64::from(step) / 60.0;
                action
            });
            world.command(k, Interpolation::Cubic, &actions[0]);
            world.command(1 - k, Interpolation::Cubic, &actions[1]);
            world.control_step(|_| [0.0; 2]);
        }
        let seen = [(0, 0), (1, 1)].map(|(world, robot)| {
            faceoff_sim::channel::observation::observe(&worlds[world], robot)
        });
        assert!(
            max_difference(&seen[0], &seen[1]) <= 1e-9,
            "step {step}: {seen:?}"
        );
    }
}

#[test]
fn window_counts_a_violation_once() {
    let mut game = Game::new(setup(Factors::NONE, 5));
    // Robot 2 lifts its mallet and keeps it lifted; robot 1 holds still.
    let hold = hold();
    let mut lift = hold;
    let mut windows = vec![];
    for _ in 0..2 * WINDOW_STEPS {
        lift[3] = (lift[3] + 0.002).min(INITIAL_Q[3] + 0.15);
        let outcome = game.step([Command::Act(&hold), Command::Act(&lift)]);
        windows.extend(outcome.window);
        if outcome.rally_end.is_some() {
            lift = hold;
        }
    }
    assert_eq!(windows.len(), 2);
    for [first, second] in windows {
        assert_eq!(first, Violations::default());
        let lifted = Violations {
            ee: true,
            ..Violations::default()
        };
        assert_eq!(second, lifted);
    }
}

#[test]
fn late_answer_commands_the_previous_position_at_rest() {
    let mut late = Game::new(setup(Factors::NONE, 6));
    let mut held = late.clone();
    let hold = hold();
    let mut moving = hold;
    moving[0] = 0.02;
    moving[7] = 0.5;
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
    let mut least = f64::INFINITY;
    for step in 0..120 {
        let reach = 0.65 + 0.009 * f64::from(step.min(100));
        for robot in 0..2 {
            let target = [reach, 0.0, EE_DESIRED_HEIGHT_M];
            let q = faceoff_sim::robot::inverse_kinematics::inverse_kinematics(
                target,
                &world.joints(robot),
            );
            let action = Interpolation::Cubic.hold_position(&q);
            world.command(robot, Interpolation::Cubic, &action[..14]);
        }
        world.control_step(|_| [0.0; 2]);
        let [a, b] = [0, 1].map(|robot| world.mallet(robot).position);
        least = least.min((a[0] - b[0]).hypot(a[1] - b[1]));
    }
    // Both are commanded 5 cm beyond the middle, where the mallets would overlap entirely.
    assert!((0.08..0.0963).contains(&least), "{least} m");
}

#[test]
fn restarted_agent_may_change_its_interpolation() {
    let mut game = Game::new(setup(Factors::NONE, 3));
    let hold = hold();
    while game.rally() == 0 {
        game.step([Command::Act(&hold); 2]);
    }
    let mut other = game.clone();
    other.set_interpolation(1, Interpolation::Linear);
    // Position alone and position at rest give the same motion, since the arm is at rest already.
    for _ in 0..20 {
        let cubic = game.step([Command::Act(&hold); 2]);
        let linear = other.step([Command::Act(&hold), Command::Act(&hold[..7])]);
        assert_eq!(cubic.state.q, linear.state.q);
        assert_eq!(linear.state, other.state());
    }
    // The interpolation also holds in later rallies.
    while other.rally() == 1 {
        other.step([Command::Act(&hold), Command::Act(&hold[..7])]);
    }
    other.step([Command::Act(&hold), Command::Act(&hold[..7])]);
    assert_eq!(other.world().joints(0), other.world().joints(1));
}

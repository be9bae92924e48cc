//! The perturbation `delay`, which is for rehearsals on a real robot: the agent sees the puck late, its actions are applied late, and the
//! table is tilted and damps the puck differently (`docs/rules.md`, "Perturbations").

use crate::{
    held_arm::{episode, hold},
    still_air::step_in_still_air,
};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Episode, Interpolation, Perturbation, PerturbationSettings, Plant, World,
    perturbation::rehearsal_table::RehearsalTable, stream::RandomStream,
};
use faceoff_types::Seed;

/// Distance of the robot's base from the table's centre along x, m.
const BASE_X_M: f64 = 1.51;

#[test]
fn puck_is_observed_one_or_two_control_steps_late() {
    // Number of observations with a delay of 0, 1 and 2 control steps.
    let (mut lag_counts, mut total) = ([0; 3], 0);
    for seed in 0..40 {
        let mut episode = episode(
            AirHockeyTask::Hit,
            ActivePerturbations::only(Perturbation::Delay),
            seed,
        );
        let mut pucks = vec![episode.state().puck];
        for _ in 0..60 {
            let end = episode.step(&hold()).end;
            pucks.push(episode.state().puck);
            let observed_x = episode.observation()[0] - BASE_X_M;
            let lag = (0..3.min(pucks.len()))
                .find(|lag| (pucks[pucks.len() - 1 - lag][0] - observed_x).abs() < 1e-15);
            // At the start there are no earlier pucks to compare with, and a puck at rest shows no lag.
            if pucks.len() > 3 && pucks[pucks.len() - 1][0] != pucks[pucks.len() - 3][0] {
                lag_counts[lag.expect("the puck of one of the last steps")] += 1;
                total += 1;
            }
            if end.is_some() {
                break;
            }
        }
    }
    let two_steps_share = f64::from(lag_counts[2]) / f64::from(total);
    assert_eq!(lag_counts[0], 0);
    // By the rules, the puck is observed two steps late with probability 0.2, otherwise one step.
    assert!(
        total > 1000 && (0.16..0.24).contains(&two_steps_share),
        "{lag_counts:?}"
    );
}

#[test]
fn joints_are_observed_without_delay() {
    let mut episode = episode(
        AirHockeyTask::Defend,
        ActivePerturbations::only(Perturbation::Delay),
        1,
    );
    let mut moving = hold();
    moving[0] = 0.02;
    for _ in 0..5 {
        episode.step(&moving);
        assert_eq!(episode.observation()[6..13], episode.state().q);
    }
}

#[test]
fn actions_are_applied_one_control_step_late() {
    let mut delayed = episode(
        AirHockeyTask::Defend,
        ActivePerturbations::only(Perturbation::Delay),
        2,
    );
    let mut prompt = episode(AirHockeyTask::Defend, ActivePerturbations::NONE, 2);
    let mut moving = hold();
    (moving[0], moving[7]) = (0.01, 0.3);
    prompt.step(&hold());
    for step in 0..20 {
        moving[0] = 0.01 * f64::from(step);
        delayed.step(&moving);
        if step > 0 {
            let mut earlier = moving;
            earlier[0] = 0.01 * f64::from(step - 1);
            prompt.step(&earlier);
        }
        assert_eq!(delayed.state().q, prompt.state().q, "step {step}");
    }
}

#[test]
fn arm_coasts_80_ms_after_a_late_action_and_stops() {
    let mut world = World::with_robots(&Plant::nominal(), 1, [0.5, 0.3, 0.0, 0.0, 0.0, 0.0]);
    let mut action = hold();
    for step in 1..=10 {
        action[0] = 0.01 * f64::from(step); // position of the first joint, rad
        action[7] = 0.5; // its velocity, rad/s
        world.command(0, Interpolation::Cubic, &action);
        step_in_still_air(&mut world);
    }
    // Movement of the first joint in each control step, rad.
    let mut movements = vec![];
    for _ in 0..20 {
        let before = world.joints(0)[0];
        world.coast(0);
        step_in_still_air(&mut world);
        movements.push(world.joints(0)[0] - before);
    }
    // At 0.5 rad/s, 10 mrad per control step; the arm follows with a small lag.
    for movement in &movements[1..4] {
        assert!((movement - 0.01).abs() < 0.001, "{movements:?}");
    }
    assert!(
        movements[13..].iter().all(|movement| movement.abs() < 1e-4),
        "{movements:?}"
    );
    // 80 ms at 0.5 rad/s.
    let total: f64 = movements.iter().sum();
    assert!((total - 0.04).abs() < 0.004, "{total}");

    // A new action ends the coasting; after the next late action the arm coasts again.
    action[0] = world.joints(0)[0] + 0.01;
    world.command(0, Interpolation::Cubic, &action);
    step_in_still_air(&mut world);
    let before = world.joints(0)[0];
    for _ in 0..2 {
        world.coast(0);
        step_in_still_air(&mut world);
    }
    assert!(world.joints(0)[0] - before > 0.01);
}

#[test]
fn rehearsal_table_has_the_statistics_of_the_rules() {
    let settings = PerturbationSettings::default().delay;
    let tables: Vec<RehearsalTable> = (0..4000)
        .map(|k| {
            let stream = RandomStream::new(&Seed::from_number(k), "delay, table");
            RehearsalTable::draw(&settings, stream)
        })
        .collect();
    let n = tables.len() as f64;
    for axis in 0..2 {
        let mean: f64 = tables.iter().map(|t| t.tilt_m_s2[axis]).sum::<f64>() / n;
        let square: f64 = tables
            .iter()
            .map(|t| t.tilt_m_s2[axis].powi(2))
            .sum::<f64>()
            / n;
        // The rules: normal with a standard deviation of 0.03 m/s².
        assert!(mean.abs() < 0.002, "{mean}");
        assert!((square.sqrt() - 0.03).abs() < 0.0015, "{}", square.sqrt());
    }
    let mean: f64 = tables.iter().map(|t| t.puck_damping_per_s).sum::<f64>() / n;
    // The rules: uniform from 0.2 to 0.5 per second.
    assert!((mean - 0.35).abs() < 0.006, "{mean}");
    assert!(
        tables
            .iter()
            .all(|t| (0.2..0.5).contains(&t.puck_damping_per_s))
    );
}

#[test]
fn tilt_and_air_cushion_act_on_the_puck() {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(7);
    let table = RehearsalTable::draw(&settings.delay, RandomStream::new(&seed, "delay, table"));
    let start = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0];
    let mut episode = Episode::with_initial_puck(
        AirHockeyTask::Hit,
        Interpolation::Cubic,
        ActivePerturbations::only(Perturbation::Delay),
        &settings,
        &Plant::nominal(),
        seed,
        start,
    );
    for _ in 0..25 {
        episode.step(&hold());
    }
    // Velocity of a damped body after a constant acceleration of 25 control steps from rest.
    let (damping_per_s, time_s) = (table.puck_damping_per_s, 0.5);
    let velocity = table
        .tilt_m_s2
        .map(|a| a * (1.0 - (-damping_per_s * time_s).exp()) / damping_per_s);
    let puck = episode.state().puck;
    for axis in 0..2 {
        let error = (puck[3 + axis] - velocity[axis]).abs();
        assert!(error < 2e-3 * velocity[axis].abs(), "{puck:?} {velocity:?}");
    }
}

#[test]
fn delay_does_not_change_draws_of_other_perturbations() {
    let alone = episode(
        AirHockeyTask::Defend,
        ActivePerturbations::only(Perturbation::ObservationNoise),
        3,
    );
    let both = episode(
        AirHockeyTask::Defend,
        ActivePerturbations::only(Perturbation::ObservationNoise).with(Perturbation::Delay),
        3,
    );
    assert_eq!(alone.observation(), both.observation());
}

//! The rehearsal's delays and table (RULES, factor `delay`).

use faceoff_sim::{
    Episode, Interpolation, PerturbationSettings, Plant, World, model::INITIAL_Q,
    perturbation::rehearsal_table::RehearsalTable, stream::Stream,
};
use faceoff_types::{Factor, Factors, Seed, Task};

fn episode(task: Task, factors: Factors, seed: u64) -> Episode {
    Episode::new(
        task,
        Interpolation::Cubic,
        factors,
        &PerturbationSettings::default(),
        &Plant::nominal(),
        Seed::from_number(seed),
    )
}

fn hold() -> [f64; 14] {
    Interpolation::Cubic.hold_position(&INITIAL_Q)[..14]
        .try_into()
        .unwrap()
}

#[test]
fn puck_is_observed_one_or_two_control_steps_late() {
    let (mut late, mut total) = ([0; 3], 0);
    for seed in 0..40 {
        let mut episode = episode(Task::Hit, Factors::only(Factor::Delay), seed);
        let mut pucks = vec![episode.state().puck];
        for _ in 0..60 {
            let end = episode.step(&hold()).end;
            pucks.push(episode.state().puck);
            let observed_x = episode.observation()[0] - 1.51;
            let lag = (0..3.min(pucks.len()))
                .find(|lag| (pucks[pucks.len() - 1 - lag][0] - observed_x).abs() < 1e-15);
            // Nothing is older than the episode; a puck at rest shows no lag.
            if pucks.len() > 3 && pucks[pucks.len() - 1][0] != pucks[pucks.len() - 3][0] {
                late[lag.expect("the puck of one of the last steps")] += 1;
                total += 1;
            }
            if end.is_some() {
                break;
            }
        }
    }
    let second = f64::from(late[2]) / f64::from(total);
    assert_eq!(late[0], 0);
    assert!(total > 1000 && (0.16..0.24).contains(&second), "{late:?}");
}

#[test]
fn joints_are_observed_without_delay() {
    let mut episode = episode(Task::Defend, Factors::only(Factor::Delay), 1);
    let mut moving = hold();
    moving[0] = 0.02;
    for _ in 0..5 {
        episode.step(&moving);
        assert_eq!(episode.observation()[6..13], episode.state().q);
    }
}

#[test]
fn actions_are_applied_one_control_step_late() {
    let mut delayed = episode(Task::Defend, Factors::only(Factor::Delay), 2);
    let mut prompt = episode(Task::Defend, Factors::NONE, 2);
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
        action[0] = 0.01 * f64::from(step);
        action[7] = 0.5;
        world.command(0, Interpolation::Cubic, &action);
        world.control_step(|_| [0.0; 2]);
    }
    let mut travelled = vec![];
    for _ in 0..20 {
        let before = world.joints(0)[0];
        world.coast(0);
        world.control_step(|_| [0.0; 2]);
        travelled.push(world.joints(0)[0] - before);
    }
    // At 0.5 rad/s, 10 mrad per control step; the arm follows with a small lag.
    for step in &travelled[1..4] {
        assert!((step - 0.01).abs() < 0.001, "{travelled:?}");
    }
    assert!(
        travelled[13..].iter().all(|step| step.abs() < 1e-4),
        "{travelled:?}"
    );
    let total: f64 = travelled.iter().sum();
    assert!((total - 0.04).abs() < 0.004, "{total}");

    // A new action ends the coasting; after the next late action the arm coasts again.
    action[0] = world.joints(0)[0] + 0.01;
    world.command(0, Interpolation::Cubic, &action);
    world.control_step(|_| [0.0; 2]);
    let before = world.joints(0)[0];
    for _ in 0..2 {
        world.coast(0);
        world.control_step(|_| [0.0; 2]);
    }
    assert!(world.joints(0)[0] - before > 0.01);
}

#[test]
fn rehearsal_table_has_the_statistics_of_the_rules() {
    let settings = PerturbationSettings::default().delay;
    let tables: Vec<RehearsalTable> = (0..4000)
        .map(|k| {
            let stream = Stream::new(&Seed::from_number(k), "delay, table");
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
        assert!(mean.abs() < 0.002, "{mean}");
        assert!((square.sqrt() - 0.03).abs() < 0.0015, "{}", square.sqrt());
    }
    let mean: f64 = tables.iter().map(|t| t.puck_damping_per_s).sum::<f64>() / n;
    assert!((mean - 0.35).abs() < 0.006, "{mean}");
    assert!(
        tables
            .iter()
            .all(|t| (0.2..0.5).contains(&t.puck_damping_per_s))
    );
}

#[test]
fn tilt_and_air_cushion_act_on_the_puck() {
    // A resting puck rolls off a tilted table as a free body does; a moving one keeps its speed longer.
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(7);
    let table = RehearsalTable::draw(&settings.delay, Stream::new(&seed, "delay, table"));
    let start = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0];
    let mut episode = Episode::with_initial_puck(
        Task::Hit,
        Interpolation::Cubic,
        Factors::only(Factor::Delay),
        &settings,
        &Plant::nominal(),
        seed,
        start,
    );
    for _ in 0..25 {
        episode.step(&hold());
    }
    let (d, t) = (table.puck_damping_per_s, 0.5);
    let velocity = table.tilt_m_s2.map(|a| a * (1.0 - (-d * t).exp()) / d);
    let puck = episode.state().puck;
    for axis in 0..2 {
        let error = (puck[3 + axis] - velocity[axis]).abs();
        assert!(error < 2e-3 * velocity[axis].abs(), "{puck:?} {velocity:?}");
    }
}

#[test]
fn delay_does_not_change_draws_of_other_factors() {
    let alone = episode(Task::Defend, Factors::only(Factor::ObservationNoise), 3);
    let both = episode(
        Task::Defend,
        Factors::only(Factor::ObservationNoise).with(Factor::Delay),
        3,
    );
    assert_eq!(alone.observation(), both.observation());
}

//! The perturbations have the statistics of the rules (`docs/rules.md`, "Perturbations"), and they are independent: none changes the
//! random numbers of another.

use crate::held_arm::{episode, hold};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Perturbation, PerturbationSettings, Plant,
    perturbation::{
        disturbance::Disturbance, noise::ObservationNoise, tracking_loss::TrackingLoss,
    },
    stream::RandomStream,
    table::puck::Puck,
};
use faceoff_types::Seed;

/// A stream of random numbers with an arbitrary seed.
fn stream(label: &str) -> RandomStream {
    RandomStream::new(&Seed::from_number(42), label)
}

fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (
        mean,
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt(),
    )
}

#[test]
fn noise_has_the_deviations_of_the_rules() {
    let settings = PerturbationSettings::default().observation_noise;
    let mut noise = ObservationNoise::new(&settings, stream("noise"));
    let draws: Vec<[f64; 20]> = (0..20_000)
        .map(|_| {
            let mut observation = [0.0; 20];
            noise.add(&mut observation);
            observation
        })
        .collect();
    // Standard deviations of puck pose and velocity, joint positions and joint velocities.
    let expected: Vec<f64> = [1e-3, 1e-3, 0.02, 0.1, 0.1, 0.1]
        .into_iter()
        .chain([1e-4; 7])
        .chain([1e-3; 7])
        .collect();
    for (i, sigma) in expected.iter().enumerate() {
        let (mean, deviation) = mean_and_deviation(&draws.iter().map(|d| d[i]).collect::<Vec<_>>());
        // Five standard errors.
        assert!(
            mean.abs() < 5.0 * sigma / 20_000f64.sqrt(),
            "{i}: mean {mean}"
        );
        assert!(
            (deviation / sigma - 1.0).abs() < 0.025,
            "{i}: deviation {deviation}"
        );
    }
}

#[test]
fn air_flow_is_stationary_with_its_correlation_time() {
    let settings = PerturbationSettings::default().disturbance;
    // At a speed of 1 m/s the force (N) is the process itself (N per m/s), from the first substep on.
    let puck = Puck::from_state([0.0, 0.0, 0.0, 0.6, 0.8, 0.0]);
    let mut first_forces = vec![];
    // Of forces that are one correlation time (0.2 s, 200 substeps) apart.
    let (mut products, mut squares) = (0.0, 0.0);
    for index in 0..400 {
        let seed = Seed::from_number(index);
        let mut air = Disturbance::new(&settings, RandomStream::new(&seed, "disturbance"));
        let forces: Vec<[f64; 2]> = (0..2_000).map(|_| air.force(&puck)).collect();
        first_forces.extend(forces[0]);
        for k in 0..1_800 {
            products += forces[k][0] * forces[k + 200][0];
            squares += forces[k][0] * forces[k][0];
        }
    }
    // The rules: standard deviation 4 mN per m/s.
    let (mean, deviation) = mean_and_deviation(&first_forces);
    assert!(mean.abs() < 0.000_8, "{mean}");
    assert!((deviation / 0.004 - 1.0).abs() < 0.12, "{deviation}");
    let deviation = (squares / (400.0 * 1_800.0)).sqrt();
    assert!((deviation / 0.004 - 1.0).abs() < 0.06, "{deviation}");
    // After one correlation time the correlation is 1/e.
    let correlation = products / squares;
    assert!(
        (correlation - (-1.0f64).exp()).abs() < 0.06,
        "{correlation}"
    );
    // A resting puck stays at rest.
    let mut air = Disturbance::new(&settings, stream("disturbance"));
    assert_eq!(air.force(&Puck::default()), [0.0; 2]);
}

#[test]
fn tracking_loss_has_the_rate_and_length_of_the_rules() {
    let settings = PerturbationSettings::default().tracking_loss;
    let mut tracking = TrackingLoss::new(&settings, stream("tracking_loss"));
    let (mut tracked_steps, mut losses, mut lengths) = (0u32, 0u32, vec![]);
    // Length of the current loss, control steps.
    let mut length = 0u32;
    for _ in 0..400_000 {
        if tracking.advance() {
            losses += u32::from(length == 0);
            length += 1;
        } else {
            if length > 0 {
                lengths.push(length);
            }
            length = 0;
            tracked_steps += 1;
        }
    }
    // The rules: a tracked puck is lost with probability 0.03 per control step, for 5 to 20 steps.
    let rate = f64::from(losses) / f64::from(tracked_steps + losses);
    assert!((rate - 0.03).abs() < 0.002, "{rate}");
    // Consecutive losses count as one here, so a few are longer than 20.
    assert_eq!(lengths.iter().min(), Some(&5));
    let single_lengths: Vec<f64> = lengths
        .iter()
        .filter(|length| **length <= 20)
        .map(|length| f64::from(*length))
        .collect();
    let (mean, _) = mean_and_deviation(&single_lengths);
    assert!((mean - 12.5).abs() < 0.3, "{mean}");
}

#[test]
fn lost_puck_is_reported_frozen_and_at_rest() {
    let active_perturbations =
        ActivePerturbations::only(Perturbation::TrackingLoss).with(Perturbation::ObservationNoise);
    let mut frozen = 0;
    for seed in 0..8 {
        let mut episode = episode(AirHockeyTask::Prepare, active_perturbations, seed);
        let mut last = episode.observation()[..3].to_vec();
        assert_ne!(episode.observation()[3], 0.0, "tracked at first");
        for _ in 0..60 {
            episode.step(&hold());
            let observation = episode.observation();
            if observation[3..6] == [0.0; 3] {
                assert_eq!(observation[..3], last[..]);
                frozen += 1;
            } else {
                assert_ne!(observation[..3], last[..]);
            }
            last = observation[..3].to_vec();
        }
    }
    assert!(frozen >= 40, "{frozen}");
}

#[test]
fn perturbation_does_not_change_draws_of_others() {
    // Noise and tracking loss do not act on the world, so that noise can be compared while the puck is tracked.
    let noise = ActivePerturbations::only(Perturbation::ObservationNoise);
    let both = noise.with(Perturbation::TrackingLoss);
    let mut ideal = episode(AirHockeyTask::Prepare, ActivePerturbations::NONE, 5);
    let mut alone = episode(AirHockeyTask::Prepare, noise, 5);
    let mut together = episode(AirHockeyTask::Prepare, both, 5);
    let mut loss = episode(
        AirHockeyTask::Prepare,
        ActivePerturbations::only(Perturbation::TrackingLoss),
        5,
    );
    for _ in 0..200 {
        for episode in [&mut ideal, &mut alone, &mut together, &mut loss] {
            episode.step(&hold());
        }
        assert_eq!(ideal.state(), together.state());
        // Joints are observed with noise whether or not the puck is lost.
        assert_eq!(alone.observation()[6..], together.observation()[6..]);
        let tracked = together.observation()[3..6] != [0.0; 3];
        if tracked {
            assert_eq!(alone.observation(), together.observation());
        }
    }
    // The air flow's draws do not depend on the other perturbations: the worlds agree bit for bit.
    let air = ActivePerturbations::only(Perturbation::Disturbance);
    let mut alone = episode(AirHockeyTask::Defend, air, 5);
    let mut together = episode(AirHockeyTask::Defend, ActivePerturbations::EVALUATION, 5);
    for _ in 0..30 {
        alone.step(&hold());
        together.step(&hold());
        assert_eq!(alone.state(), together.state());
    }
    // The initial state depends on no perturbation.
    assert_eq!(
        episode(AirHockeyTask::Hit, ActivePerturbations::NONE, 9).state(),
        episode(AirHockeyTask::Hit, ActivePerturbations::EVALUATION, 9).state()
    );
}

#[test]
fn mismatched_plants_sag_by_five_to_ten_millimetres() {
    let settings = PerturbationSettings::default();
    for seed in 0..8 {
        let plant = Plant::mismatched(&settings, Seed::from_number(seed));
        let error = plant.largest_static_error();
        assert!((0.005..=0.010).contains(&error), "{error}");
        assert_eq!(plant, Plant::mismatched(&settings, Seed::from_number(seed)));
        assert_ne!(plant, Plant::nominal());
    }
    let nominal = Plant::nominal().largest_static_error();
    // The nominal arm sags by the mallet's weight alone, which the controller's model does not contain.
    assert!((0.002..0.010).contains(&nominal), "{nominal}");
}

#[test]
fn initial_states_fill_the_ranges_of_the_rules() {
    let states = |task| {
        (0..2_000).map(move |seed| episode(task, ActivePerturbations::NONE, seed).state().puck)
    };
    let range = |values: Vec<f64>| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        (
            low,
            values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let assert_fills = |(low, high): (f64, f64), expected: [f64; 2]| {
        let slack = 0.01 * (expected[1] - expected[0]);
        assert!(
            low >= expected[0] && low < expected[0] + slack,
            "{low} {expected:?}"
        );
        assert!(
            high <= expected[1] && high > expected[1] - slack,
            "{high} {expected:?}"
        );
    };
    assert_fills(
        range(states(AirHockeyTask::Hit).map(|p| p[0]).collect()),
        [-0.7, -0.2],
    );
    assert_fills(
        range(states(AirHockeyTask::Hit).map(|p| p[1]).collect()),
        [-0.39105, 0.39105],
    );
    assert_fills(
        range(
            states(AirHockeyTask::Hit)
                .map(|p| p[3].hypot(p[4]))
                .collect(),
        ),
        [0.0, 0.5],
    );
    assert_fills(
        range(states(AirHockeyTask::Hit).map(|p| p[5]).collect()),
        [-2.0, 2.0],
    );
    assert_fills(
        range(states(AirHockeyTask::Defend).map(|p| p[0]).collect()),
        [0.29, 0.65],
    );
    assert_fills(
        range(
            states(AirHockeyTask::Defend)
                .map(|p| p[3].hypot(p[4]))
                .collect(),
        ),
        [1.0, 3.0],
    );
    assert_fills(
        range(
            states(AirHockeyTask::Defend)
                .map(|p| (p[4]).atan2(-p[3]))
                .collect(),
        ),
        [-0.5, 0.5],
    );
    let prepare: Vec<[f64; 6]> = states(AirHockeyTask::Prepare).collect();
    // Share of the pucks that start in the strip along the side.
    let side_share = prepare.iter().filter(|p| p[0] >= -0.8).count() as f64 / 2_000.0;
    // The areas of the strips: 0.6 m × 0.0943 m along the side, 0.14 m × 0.36035 m in the corner.
    assert!((side_share - 0.5286).abs() < 0.06, "{side_share}");
    for p in &prepare {
        let least = if p[0] >= -0.8 { 0.39105 } else { 0.125 };
        assert!((least..=0.48535).contains(&p[1].abs()) && (-0.94..=-0.2).contains(&p[0]));
    }
}

//! Mallet against puck (REFERENCE, `mallet_impact`).

use crate::reference::{array, flat, quantile, recording, rows};
use faceoff_sim::{Interpolation, MalletState, Plant, SUBSTEPS, World};

#[test]
fn impacts_match_recordings() {
    let recording = recording("mallet_impact");
    let (mut velocity_errors, mut position_errors) = (vec![], vec![]);
    let mut real_arm = 0.0f64;
    for case in recording["cases"].as_array().unwrap() {
        let recorded: Vec<[f64; 11]> = rows(&case["rows"]);
        let kind = case["kind"].as_str().unwrap();
        let mut world = World::with_robots(&Plant::nominal(), 1, array(&case["puck_init"]));
        let mut ours = vec![];
        for (k, row) in recorded.iter().enumerate() {
            if kind.starts_with("override") {
                world.impose_mallet(Some(MalletState {
                    position: [row[0], row[1], row[2]],
                    velocity: [row[3], row[4]],
                }));
            } else if k % SUBSTEPS == 0 {
                match case["actions"].get(k / SUBSTEPS) {
                    Some(action) => world.command(0, Interpolation::Cubic, &flat(action)),
                    None => world.hold(0, Interpolation::Cubic),
                }
            }
            ours.push(world.puck().state());
            world.substep();
        }
        let puck = |k: usize| -> [f64; 6] { std::array::from_fn(|i| recorded[k][5 + i]) };
        let peak = (0..recorded.len())
            .map(|k| puck(k)[3].hypot(puck(k)[4]))
            .fold(0.0, f64::max);
        let last = recorded.len() - 1;
        let (a, b) = (ours[last], puck(last));
        let velocity = (a[3] - b[3]).hypot(a[4] - b[4]) / peak;
        let position = (a[0] - b[0]).hypot(a[1] - b[1]);
        println!("{kind} velocity {velocity:.2e} position {position:.2e}");
        if kind.starts_with("realarm") {
            real_arm = real_arm.max(velocity);
        }
        velocity_errors.push(velocity);
        position_errors.push(position);
    }
    let (median, p90) = (
        quantile(&mut velocity_errors, 0.5),
        quantile(&mut velocity_errors, 0.9),
    );
    let position = quantile(&mut position_errors, 0.5);
    println!("velocity median {median:.2e}, p90 {p90:.2e}; position median {position:.2e} m");
    assert!(median <= 0.015 && p90 <= 0.04);
    // An imposed mallet leans in the reference, but the recordings do not say how; an arm's own does.
    println!("with a real arm: velocity at most {real_arm:.2e}");
    assert!(real_arm <= 5e-4, "{real_arm}");
    assert!(position <= 0.003);
}

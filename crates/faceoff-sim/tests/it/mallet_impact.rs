//! Impacts of a mallet on the puck match the recording `mallet_impact` of the *reference*, the simulator of the 2023 Robot Air Hockey
//! Challenge. In some the mallet's motion is *imposed*: taken from the recording instead of simulated.

use crate::{reference::quantile, replay::impacts};

#[test]
fn impacts_match_recordings() {
    let impacts = impacts();
    let mut velocities: Vec<f64> = impacts.iter().map(|impact| impact.velocity_error).collect();
    let mut positions: Vec<f64> = impacts
        .iter()
        .map(|impact| impact.position_error_m)
        .collect();
    let (median, p90) = (
        quantile(&mut velocities, 0.5),
        quantile(&mut velocities, 0.9),
    );
    let position = quantile(&mut positions, 0.5);
    println!("velocity median {median:.2e}, p90 {p90:.2e}; position median {position:.2e} m");
    assert!(median <= 0.015 && p90 <= 0.04);
    assert!(position <= 0.003);
    // The bounds above are wide because of imposed mallets: in the reference they lean, but the recordings do not contain the lean. A
    // mallet that the simulated arm moves leans as in the reference.
    let errors_by_arm: Vec<f64> = impacts
        .iter()
        .filter(|impact| impact.is_moved_by_arm())
        .map(|impact| impact.velocity_error)
        .collect();
    let largest = errors_by_arm.iter().fold(0.0, |a: f64, b| a.max(*b));
    println!(
        "{} impacts by the arm: velocity at most {largest:.2e}",
        errors_by_arm.len()
    );
    assert!(errors_by_arm.len() == 16 && largest <= 5e-4);
}

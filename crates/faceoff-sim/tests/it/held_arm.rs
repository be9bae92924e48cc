//! Episodes in which the arm holds its initial position.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Episode, Interpolation, PerturbationSettings, Plant, model::INITIAL_Q,
};
use faceoff_types::Seed;

/// An episode of the nominal plant, with the rules' perturbation settings.
pub fn episode(
    task: AirHockeyTask,
    active_perturbations: ActivePerturbations,
    seed: u64,
) -> Episode {
    Episode::new(
        task,
        Interpolation::Cubic,
        active_perturbations,
        &PerturbationSettings::default(),
        &Plant::nominal(),
        Seed::from_number(seed),
    )
}

/// An action that holds the initial position: seven positions, rad, and seven velocities, rad/s.
pub fn hold() -> [f64; 14] {
    let mut action = [0.0; 14];
    action[..7].copy_from_slice(&INITIAL_Q);
    action
}

//! The *fingerprint* of the simulator: a hash of the motion in a short episode of each task with all perturbations. A simulator that
//! computes other numbers has another one.

use crate::PerturbationSettings;
use crate::{AirHockeyProfile, AirHockeyTask, Episode, EpisodeState, Interpolation, JOINTS, Plant};
use faceoff_types::Seed;
use std::sync::OnceLock;

/// Control steps of each episode: enough for contacts of the puck with rim and mallet.
const STEPS: u32 = 60;

/// The hash, as 64 hexadecimal digits.
pub fn simulator_fingerprint() -> &'static str {
    static FINGERPRINT: OnceLock<String> = OnceLock::new();
    FINGERPRINT.get_or_init(compute)
}

fn compute() -> String {
    let mut hasher = blake3::Hasher::new();
    let seed = Seed::from_number(0);
    let settings = PerturbationSettings::default();
    let plant = Plant::mismatched(&settings, seed.model_mismatch());
    for task in AirHockeyTask::ALL {
        let mut episode = Episode::new(
            task,
            Interpolation::Cubic,
            AirHockeyProfile::Evaluation.active_perturbations(),
            &settings,
            &plant,
            seed.episode(task, 0),
        );
        let initial_joints = episode.state().q;
        for step in 0..STEPS {
            add(&mut hasher, episode.observation());
            let mut action = [0.0; 2 * JOINTS];
            action[..JOINTS].copy_from_slice(&initial_joints);
            // A slow swing of the base joint, so that the fingerprint covers the arm's dynamics.
            action[0] += 0.005 * f64::from(step);
            let outcome = episode.step(&action);
            let constraints = outcome.constraints;
            add(
                &mut hasher,
                &[
                    constraints.joint_pos,
                    constraints.joint_vel,
                    constraints.ee,
                    constraints.link,
                ],
            );
            add_state(&mut hasher, &episode.state());
            if outcome.end.is_some() {
                break;
            }
        }
    }
    hasher.finalize().to_hex().to_string()
}

fn add(hasher: &mut blake3::Hasher, numbers: &[f64]) {
    for number in numbers {
        hasher.update(&number.to_le_bytes());
    }
}

fn add_state(hasher: &mut blake3::Hasher, state: &EpisodeState) {
    add(hasher, &state.puck);
    add(hasher, &state.q);
    add(hasher, &state.dq);
    add(hasher, &state.dq_filtered);
    add(hasher, &state.universal);
    add(hasher, &state.ee);
    add(hasher, state.opponent_q.as_ref().map_or(&[], |q| q));
    add(hasher, state.opponent_ee.as_ref().map_or(&[], |ee| ee));
}

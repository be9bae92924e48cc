//! The plant of a season, with its model mismatch.

use crate::{
    dynamics::arm::{Bodies, Kinematics, controller_torques, plant_bias},
    model::{DOFS, EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS, LINKS},
    robot::{
        inverse_kinematics::{inverse_kinematics, with_zero_universal},
        plant::Plant,
        universal_joint::vertical,
    },
    stream::Stream,
};
use faceoff_types::{Factor, Factors, MismatchSettings, PerturbationSettings, Seed};

/// End-effector positions over the table at which the static error is evaluated, m, base frame.
const WORKSPACE_X_M: [f64; 4] = [0.65, 0.85, 1.05, 1.2];
const WORKSPACE_Y_M: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// Limit of draws, after which the last one is used. The ruleset's settings accept about one draw in three, so
/// only settings that cannot be met reach it.
const DRAWS: usize = 10_000;

/// Number of draws that suffices for all settings that can be met in practice.
const EXPECTED_DRAWS: usize = 300;

/// Iterations of the fixed-point iteration for the sag; each adds two to three digits.
const SAG_ROUNDS: usize = 12;

impl Plant {
    /// The plant for these factors: nominal, or that of the season with this mismatch seed.
    #[must_use]
    pub fn for_factors(
        factors: Factors,
        settings: &PerturbationSettings,
        mismatch_seed: Seed,
    ) -> Self {
        if factors.contains(Factor::ModelMismatch) {
            Self::mismatched(settings, mismatch_seed)
        } else {
            Self::nominal()
        }
    }

    /// Draws the plant of a season: factors on masses, gains, damping and friction, redrawn until
    /// the largest static end-effector error over the workspace lies in the settings' range. `seed`
    /// is the season's mismatch seed.
    #[must_use]
    pub fn mismatched(settings: &PerturbationSettings, seed: Seed) -> Self {
        draw_in_range(&settings.model_mismatch, seed, DRAWS).0
    }

    /// Is a plant within these settings' range found in a reasonable number of draws? Otherwise episodes would use a
    /// plant out of range, after seconds of draws.
    #[must_use]
    pub fn can_be_drawn(settings: &PerturbationSettings, seed: Seed) -> bool {
        draw_in_range(&settings.model_mismatch, seed, EXPECTED_DRAWS).1
    }

    /// The largest distance, m, between commanded and reached end-effector position over the workspace, at
    /// rest, when friction carries no load.
    #[must_use]
    pub fn largest_static_error(&self) -> f64 {
        largest_static_error(self, &workspace())
    }
}

/// The first plant of at most `draws` whose static error is in range, otherwise the last one; and whether it is
/// in range.
fn draw_in_range(settings: &MismatchSettings, seed: Seed, draws: usize) -> (Plant, bool) {
    let [least, most] = settings.static_error_m;
    let workspace = workspace();
    let is_in_range =
        |plant: &Plant| (least..=most).contains(&largest_static_error(plant, &workspace));
    let mut stream = Stream::new(&seed, "plant");
    let mut plant = draw(settings, &mut stream);
    for _ in 1..draws {
        if is_in_range(&plant) {
            return (plant, true);
        }
        plant = draw(settings, &mut stream);
    }
    let in_range = is_in_range(&plant);
    (plant, in_range)
}

fn draw(settings: &MismatchSettings, stream: &mut Stream) -> Plant {
    let mut factors = |[low, high]: [f64; 2]| -> [f64; JOINTS] {
        std::array::from_fn(|_| stream.uniform(low, high))
    };
    let links = factors(settings.mass);
    let kp = factors(settings.gains);
    let kd = factors(settings.gains);
    let damping = factors(settings.friction);
    let friction = factors(settings.friction);
    let [end_effector, mallet] = {
        let [low, high] = settings.mass;
        [stream.uniform(low, high), stream.uniform(low, high)]
    };
    let mut mass_scale = [1.0; 9];
    mass_scale[..JOINTS].copy_from_slice(&links);
    mass_scale[7] = end_effector;
    mass_scale[8] = mallet;
    Plant::new(
        mass_scale,
        std::array::from_fn(|i| LINKS[i].kp * kp[i]),
        std::array::from_fn(|i| LINKS[i].kd * kd[i]),
        std::array::from_fn(|i| LINKS[i].damping * damping[i]),
        std::array::from_fn(|i| LINKS[i].friction_n_m * friction[i]),
    )
}

fn workspace() -> Vec<[f64; JOINTS]> {
    let mut poses = Vec::new();
    for x in WORKSPACE_X_M {
        for y in WORKSPACE_Y_M {
            poses.push(inverse_kinematics([x, y, EE_DESIRED_HEIGHT_M], &INITIAL_Q));
        }
    }
    poses
}

fn largest_static_error(plant: &Plant, workspace: &[[f64; JOINTS]]) -> f64 {
    workspace
        .iter()
        .map(|desired| static_error(plant, desired))
        .fold(0.0, f64::max)
}

/// Distance between the commanded end-effector position and where gravity and gains balance.
fn static_error(plant: &Plant, desired: &[f64; JOINTS]) -> f64 {
    let target = Kinematics::new(&with_zero_universal(desired))
        .end_effector
        .origin;
    let mut q = with_zero_universal(desired);
    for _ in 0..SAG_ROUNDS {
        let kinematics = Kinematics::new(&q);
        let ee = &kinematics.end_effector;
        let universal = vertical(ee.x, ee.y, [q[7], q[8]]);
        let bodies = Bodies::new(&kinematics);
        let feed_forward = controller_torques(
            &kinematics,
            &bodies.controller(),
            &[0.0; JOINTS],
            &[0.0; JOINTS],
        );
        let load = plant_bias(&kinematics, &bodies.plant(&plant.mass_scale), &[0.0; DOFS]);
        for i in 0..JOINTS {
            q[i] = desired[i] + (feed_forward[i] - load[i]) / plant.kp[i];
        }
        q[JOINTS..].copy_from_slice(&universal);
    }
    let reached = Kinematics::new(&q).end_effector.origin;
    let error = reached - target;
    error.dot(error).sqrt()
}

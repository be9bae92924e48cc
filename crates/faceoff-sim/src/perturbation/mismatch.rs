//! The season's plant.

use crate::{
    dynamics::arm::{Bodies, Kinematics, controller_torques, plant_bias},
    model::{DOFS, EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS, LINKS},
    robot::{
        inverse_kinematics::{full, inverse_kinematics},
        plant::Plant,
        universal_joint::vertical,
    },
    stream::Stream,
};
use faceoff_types::{Factor, Factors, MismatchSettings, PerturbationSettings, Seed};

/// Where the static error is looked at: end-effector positions over the table, m, base frame.
const WORKSPACE_X_M: [f64; 4] = [0.65, 0.85, 1.05, 1.2];
const WORKSPACE_Y_M: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// Draws before the last one is taken as it is. About one draw in three is accepted with the
/// ruleset's settings, so that only settings that cannot be met come this far.
const DRAWS: usize = 10_000;

/// What one must expect to be enough of magnitudes that can be met at all.
const EXPECTED_DRAWS: usize = 300;

/// Rounds of the fixed-point iteration for the sag; each gains two to three digits.
const SAG_ROUNDS: usize = 12;

impl Plant {
    /// The plant under these factors: nominal, or that of the season with this mismatch seed.
    #[must_use]
    pub fn under(factors: Factors, settings: &PerturbationSettings, mismatch_seed: Seed) -> Self {
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
        drawn(&settings.model_mismatch, seed, DRAWS).0
    }

    /// Is a plant found within these settings' range before the draws become many? Magnitudes that are not met by any
    /// would be played outside of it, after seconds of draws.
    #[must_use]
    pub fn can_be_drawn(settings: &PerturbationSettings, seed: Seed) -> bool {
        drawn(&settings.model_mismatch, seed, EXPECTED_DRAWS).1
    }

    /// The largest distance, m, between commanded and reached end-effector position over the
    /// workspace, at rest, once the joints have crept to where friction no longer carries.
    #[must_use]
    pub fn largest_static_error(&self) -> f64 {
        largest_static_error(self, &workspace())
    }
}

/// The first plant of at most so many whose static error is in range, or else the last one; and whether it is.
fn drawn(settings: &MismatchSettings, seed: Seed, draws: usize) -> (Plant, bool) {
    let [least, most] = settings.static_error_m;
    let workspace = workspace();
    let is_met = |plant: &Plant| (least..=most).contains(&largest_static_error(plant, &workspace));
    let mut stream = Stream::new(&seed, "plant");
    let mut plant = draw(settings, &mut stream);
    for _ in 1..draws {
        if is_met(&plant) {
            return (plant, true);
        }
        plant = draw(settings, &mut stream);
    }
    let met = is_met(&plant);
    (plant, met)
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
    let target = Kinematics::new(&full(desired)).end_effector.origin;
    let mut q = full(desired);
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

//! The perturbation `model_mismatch`: the *plant* (the physical properties of the arm) deviates from the nominal model that agents know. It
//! is drawn once per season.

use crate::{ActivePerturbations, Perturbation};
use crate::{MismatchSettings, PerturbationSettings};
use crate::{
    dynamics::arm::{Bodies, Kinematics, controller_torques, plant_bias},
    model::{DOFS, EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS, LINKS},
    robot::{
        inverse_kinematics::{inverse_kinematics, with_zero_universal},
        plant::Plant,
        universal_joint::mallet_vertical_angles,
    },
    stream::RandomStream,
};
use faceoff_types::Seed;

/// The *workspace*: end-effector positions over the table at which the static error is evaluated, m, base frame. The *static error* is the
/// distance between commanded and reached position at rest.
const WORKSPACE_X_M: [f64; 4] = [0.65, 0.85, 1.05, 1.2];
const WORKSPACE_Y_M: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// Largest number of draws; the last one is used in any case. The ruleset's settings accept about one draw in three, so
/// only settings that cannot be met reach this number.
const MAX_DRAWS: usize = 10_000;

/// Number of draws within which a plant must be found, so that settings are accepted.
const MAX_ACCEPTED_DRAWS: usize = 300;

/// Iterations of the fixed-point iteration for the sag (the joint deviations due to gravity); each adds two to three digits.
const SAG_ROUNDS: usize = 12;

impl Plant {
    /// The plant for these active perturbations: nominal, or that of the season with this mismatch seed.
    #[must_use]
    pub fn for_perturbations(
        active_perturbations: ActivePerturbations,
        settings: &PerturbationSettings,
        mismatch_seed: Seed,
    ) -> Self {
        if active_perturbations.contains(Perturbation::ModelMismatch) {
            Self::mismatched(settings, mismatch_seed)
        } else {
            Self::nominal()
        }
    }

    /// Draws the plant of a season: its masses, gains, damping and friction are those of the nominal model times random multipliers. They
    /// are redrawn until the largest static end-effector error over the workspace lies in the settings' range. `seed` is the season's
    /// mismatch seed.
    #[must_use]
    pub fn mismatched(settings: &PerturbationSettings, seed: Seed) -> Self {
        draw_in_range(&settings.model_mismatch, seed, MAX_DRAWS).0
    }

    /// Is a plant within the settings' range of static errors found in a reasonable number of draws? Settings for which it is not must
    /// be refused: episodes would use a plant out of range, after seconds of draws.
    #[must_use]
    pub fn can_be_drawn(settings: &PerturbationSettings, seed: Seed) -> bool {
        draw_in_range(&settings.model_mismatch, seed, MAX_ACCEPTED_DRAWS).1
    }

    /// The largest static error over the workspace, m: the distance between commanded and reached end-effector position at rest, if dry
    /// friction carries no load.
    #[must_use]
    pub fn largest_static_error(&self) -> f64 {
        largest_static_error(self, &workspace())
    }
}

/// Draws plants until the static error of one is in range, at most `max_draws`. Returns the last plant, and whether it is
/// in range.
fn draw_in_range(settings: &MismatchSettings, seed: Seed, max_draws: usize) -> (Plant, bool) {
    let [least, most] = settings.static_error_m;
    let workspace = workspace();
    let is_in_range =
        |plant: &Plant| (least..=most).contains(&largest_static_error(plant, &workspace));
    let mut stream = RandomStream::new(&seed, "plant");
    let mut plant = draw(settings, &mut stream);
    for _ in 1..max_draws {
        if is_in_range(&plant) {
            return (plant, true);
        }
        plant = draw(settings, &mut stream);
    }
    let in_range = is_in_range(&plant);
    (plant, in_range)
}

/// Draws one plant.
fn draw(settings: &MismatchSettings, stream: &mut RandomStream) -> Plant {
    let mut draw_multipliers = |[low, high]: [f64; 2]| -> [f64; JOINTS] {
        std::array::from_fn(|_| stream.uniform(low, high))
    };
    let links = draw_multipliers(settings.mass);
    let kp = draw_multipliers(settings.gains);
    let kd = draw_multipliers(settings.gains);
    let damping = draw_multipliers(settings.friction);
    let friction = draw_multipliers(settings.friction);
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

/// The commanded joint positions (rad) for each position of the workspace.
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

/// Distance, m, between the commanded end-effector position and the one where gravity and the controller's gains balance.
fn static_error(plant: &Plant, desired: &[f64; JOINTS]) -> f64 {
    let target = Kinematics::new(&with_zero_universal(desired))
        .end_effector
        .origin;
    let mut q = with_zero_universal(desired);
    for _ in 0..SAG_ROUNDS {
        let kinematics = Kinematics::new(&q);
        let ee = &kinematics.end_effector;
        let universal = mallet_vertical_angles(ee.x, ee.y, [q[7], q[8]]);
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

//! The native half of the Python package `faceoff`: the simulator, the evaluator and the arm's kinematics, for Python
//! programs. A *world* is one simulated table with its robots and puck; an environment has one world or many.
//!
//! This crate converts arguments to the types of the other crates, and their results to arrays. It has
//! no simulation logic, and converts panics to exceptions.

#![warn(missing_docs)]

mod actions;
mod batch;
mod errors;
mod evaluate;
mod games;
mod kinematics;
mod numpy_outputs;
mod observation;
mod outputs;
mod pool;
mod reward;
mod setup;
mod snapshot;
mod step;
mod world;
mod worlds;

use pyo3::prelude::*;

/// `faceoff._native`; users import the Python package around it.
#[pymodule]
mod _native {
    use crate::{
        errors::{argument_error, catch_panic},
        games::{GAME_INFO_LEN, GAME_STATE_LEN, RALLY_ENDS},
        observation::BOUNDS,
        outputs::EPISODE_INFO_LEN,
        world::STATE_LEN,
    };
    use faceoff_types::EPISODE_STEPS;
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::{
        batch::Batch,
        evaluate::{Evaluation, PolicyEpisode},
        games::{GameSnapshot, Games, load_game},
        kinematics::{
            arm_constants, arm_constraints, arm_forward, arm_frames, arm_heights, arm_inverse,
            arm_jacobian, arm_posture_velocities, arm_velocities,
        },
        snapshot::{Snapshot, load_snapshot},
        worlds::Worlds,
    };

    /// Lowest and highest values of an observation with an opponent; without one the first 20 apply.
    #[pyfunction]
    fn observation_bounds() -> Vec<[f32; 2]> {
        BOUNDS.to_vec()
    }

    /// Limits of the seven joints: positions ± rad, velocities ± rad/s, accelerations ± rad/s².
    #[pyfunction]
    fn joint_limits() -> [[f64; 7]; 3] {
        let info = faceoff_sim::env_info(faceoff_sim::AirHockeyTask::Defend);
        let [_, position] = info.joint_pos_limit;
        let [_, velocity] = info.joint_vel_limit;
        let [_, acceleration] = info.joint_acc_limit;
        [position, velocity, acceleration]
    }

    /// Joint positions at the start of an episode, rad.
    #[pyfunction]
    fn start_pose() -> [f64; 7] {
        faceoff_sim::model::INITIAL_Q
    }

    /// Lengths of an action's nested arrays, outermost first, for the code of an interpolation, the rule by which an
    /// action becomes a trajectory of 20 ms.
    #[pyfunction]
    fn action_shape(interpolation: Option<i64>) -> PyResult<Vec<usize>> {
        let interpolation = faceoff_sim::Interpolation::from_code(interpolation);
        let interpolation = interpolation.map_err(|error| {
            argument_error("interpolation", "1, 2, 3, 4, 5, -1 or None", error.0)
        })?;
        Ok(interpolation.shape().to_vec())
    }

    /// Panics, for the test of the conversion to an exception.
    #[pyfunction]
    fn provoke_panic() -> PyResult<()> {
        catch_panic(|| -> PyResult<()> { panic!("provoked") })
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let ends = faceoff_sim::episode::ends::ALL.map(|end| end.to_string());
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("ENDS", ends)?;
        module.add("EPISODE_INFO_LEN", EPISODE_INFO_LEN)?;
        module.add("GAME_INFO_LEN", GAME_INFO_LEN)?;
        module.add("GAME_STATE_LEN", GAME_STATE_LEN)?;
        module.add("RALLY_ENDS", RALLY_ENDS)?;
        module.add("STATE_LEN", STATE_LEN)?;
        module.add("EPISODE_STEPS", EPISODE_STEPS)
    }
}

//! The native half of the Python package `faceoff`: the simulator, the evaluator and the arm's kinematics, for programs
//! in Python.
//!
//! This crate turns arguments into the types of the other crates, and their results into arrays. It
//! decides nothing about the simulation, and no panic of the other crates leaves it as one.

#![warn(missing_docs)]

mod actions;
mod batch;
mod errors;
mod evaluate;
mod game;
mod kinematics;
mod observation;
mod outputs;
mod pool;
mod reward;
mod rows;
mod setup;
mod snapshot;
mod step;
mod world;
mod worlds;

use pyo3::prelude::*;

/// `faceoff._native`; what users import is the Python package around it.
#[pymodule]
mod _native {
    use crate::{
        errors::{argument, fenced},
        observation::BOUNDS,
        outputs::FACTS,
        world::STATE_LEN,
    };
    use faceoff_types::{EPISODE_STEPS, EpisodeEnd};
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::{
        batch::Batch,
        evaluate::{Evaluation, PolicyCourse},
        game::Game,
        kinematics::{
            arm_constraints, arm_forward, arm_frames, arm_heights, arm_inverse, arm_jacobian,
            arm_numbers, arm_posture_velocities, arm_velocities,
        },
        snapshot::{Snapshot, load_snapshot},
        worlds::Worlds,
    };

    /// Least and greatest values of an observation with an opponent; without one it is the first 20.
    #[pyfunction]
    fn observation_bounds() -> Vec<[f32; 2]> {
        BOUNDS.to_vec()
    }

    /// Limits of the seven joints: positions ± rad, velocities ± rad/s, accelerations ± rad/s².
    #[pyfunction]
    fn joint_limits() -> [[f64; 7]; 3] {
        let info = faceoff_sim::env_info(faceoff_types::Task::Defend);
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

    /// Lengths of an action's nested arrays, outermost first, for an interpolation's code.
    #[pyfunction]
    fn action_shape(interpolation: Option<i64>) -> PyResult<Vec<usize>> {
        let known = faceoff_types::Interpolation::from_code(interpolation);
        let known = known
            .map_err(|error| argument("interpolation", "1, 2, 3, 4, 5, -1 or None", error.0))?;
        Ok(known.shape().to_vec())
    }

    /// Panics, so that a test sees what comes of it.
    #[pyfunction]
    fn provoke_panic() -> PyResult<()> {
        fenced(|| -> PyResult<()> { panic!("provoked") })
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let ends = [
            EpisodeEnd::Horizon,
            EpisodeEnd::LeftTable,
            EpisodeEnd::CrossedMiddle,
            EpisodeEnd::Stopped,
            EpisodeEnd::ReachedAxis,
            EpisodeEnd::AgentFault,
        ];
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("ENDS", ends.map(EpisodeEnd::as_str))?;
        module.add("FACTS", FACTS)?;
        module.add("STATE_LEN", STATE_LEN)?;
        module.add("EPISODE_STEPS", EPISODE_STEPS)
    }
}

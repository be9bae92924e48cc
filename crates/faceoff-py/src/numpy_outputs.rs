//! The NumPy arrays, allocated by the Python half, into which a step writes its results. They become [`Outputs`], slices of the arrays.

use crate::{
    errors::argument_error,
    outputs::{EPISODE_INFO_LEN, Outputs},
    world::STATE_LEN,
};
use numpy::{PyReadwriteArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Arrays with a row per world, allocated by the Python half: observations, final observations, rewards, terminated,
/// truncated, episode infos, true states and next true states; see [`Outputs`].
#[derive(FromPyObject)]
pub struct NumpyOutputs<'py>(
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray1<'py, f64>,
    PyReadwriteArray1<'py, bool>,
    PyReadwriteArray1<'py, bool>,
    PyReadwriteArray2<'py, f64>,
    PyReadwriteArray2<'py, f64>,
    PyReadwriteArray2<'py, f64>,
);

impl NumpyOutputs<'_> {
    /// The arrays as slices of `worlds` rows.
    ///
    /// # Errors
    /// If an array has another shape or is not contiguous.
    pub fn outputs(&mut self, worlds: usize, observation_len: usize) -> PyResult<Outputs<'_>> {
        let Self(
            observations,
            final_observations,
            rewards,
            terminated,
            truncated,
            episode_info,
            states,
            next_states,
        ) = self;
        let check_matrix = |name, shape: &[usize], width, optional| match shape {
            [rows, columns] if *rows == worlds && *columns == width => Ok(()),
            [0, _] if optional => Ok(()),
            other => Err(argument_error(
                name,
                format!("an array of shape ({worlds}, {width})"),
                format!("one of shape {other:?}"),
            )),
        };
        let check_vector = |name, len| {
            if len == worlds {
                return Ok(());
            }
            let expected = format!("an array of length {worlds}");
            Err(argument_error(
                name,
                expected,
                format!("one of length {len}"),
            ))
        };
        check_matrix("observations", observations.shape(), observation_len, false)?;
        check_matrix(
            "final observations",
            final_observations.shape(),
            observation_len,
            true,
        )?;
        check_vector("rewards", rewards.len())?;
        check_vector("terminated", terminated.len())?;
        check_vector("truncated", truncated.len())?;
        check_matrix(
            "episode_info",
            episode_info.shape(),
            EPISODE_INFO_LEN,
            false,
        )?;
        check_matrix("states", states.shape(), STATE_LEN, true)?;
        check_matrix("next states", next_states.shape(), STATE_LEN, true)?;
        Ok(Outputs {
            observation_len,
            observations: observations.as_slice_mut()?,
            final_observations: final_observations.as_slice_mut()?,
            rewards: rewards.as_slice_mut()?,
            terminated: terminated.as_slice_mut()?,
            truncated: truncated.as_slice_mut()?,
            episode_info: episode_info.as_slice_mut()?,
            states: states.as_slice_mut()?,
            next_states: next_states.as_slice_mut()?,
        })
    }
}

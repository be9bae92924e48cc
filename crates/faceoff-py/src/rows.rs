//! NumPy arrays as output rows.

use crate::{
    errors::argument_error,
    outputs::{FACTS, Outputs},
    world::STATE_LEN,
};
use numpy::{PyReadwriteArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Arrays with a row per world, allocated by the Python half: observations, final observations, rewards, terminated,
/// truncated, facts, true states and next true states; see [`Outputs`].
#[derive(FromPyObject)]
pub struct Rows<'py>(
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray1<'py, f64>,
    PyReadwriteArray1<'py, bool>,
    PyReadwriteArray1<'py, bool>,
    PyReadwriteArray2<'py, f64>,
    PyReadwriteArray2<'py, f64>,
    PyReadwriteArray2<'py, f64>,
);

impl Rows<'_> {
    /// The arrays as slices of `worlds` rows.
    ///
    /// # Errors
    /// If an array has another shape or is not contiguous.
    pub fn outputs(&mut self, worlds: usize, observation_len: usize) -> PyResult<Outputs<'_>> {
        let wide = |name, shape: &[usize], width, optional| match shape {
            [rows, columns] if *rows == worlds && *columns == width => Ok(()),
            [0, _] if optional => Ok(()),
            other => Err(argument_error(
                name,
                format!("an array of shape ({worlds}, {width})"),
                format!("one of shape {other:?}"),
            )),
        };
        let narrow = |name, len| {
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
        wide("observations", self.0.shape(), observation_len, false)?;
        wide("final observations", self.1.shape(), observation_len, true)?;
        narrow("rewards", self.2.len())?;
        narrow("terminated", self.3.len())?;
        narrow("truncated", self.4.len())?;
        wide("facts", self.5.shape(), FACTS, false)?;
        wide("states", self.6.shape(), STATE_LEN, true)?;
        wide("next states", self.7.shape(), STATE_LEN, true)?;
        Ok(Outputs {
            observation_len,
            observations: self.0.as_slice_mut()?,
            final_observations: self.1.as_slice_mut()?,
            rewards: self.2.as_slice_mut()?,
            terminated: self.3.as_slice_mut()?,
            truncated: self.4.as_slice_mut()?,
            facts: self.5.as_slice_mut()?,
            states: self.6.as_slice_mut()?,
            next_states: self.7.as_slice_mut()?,
        })
    }
}

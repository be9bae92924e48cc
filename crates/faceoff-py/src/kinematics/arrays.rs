//! Access to NumPy arrays as rows of numbers: an array of shape (2, 5, 7) has 10 rows of 7 numbers.

use crate::errors::{argument_error, catch_panic};
use numpy::{Element, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// An array to read.
pub type Input<'py> = PyReadonlyArrayDyn<'py, f64>;
/// An array of numbers or flags to write.
pub type Output<'py, T = f64> = PyReadwriteArrayDyn<'py, T>;

/// The rows of N numbers over all leading dimensions.
///
/// # Errors
/// If the array is not contiguous, or its last dimensions do not form rows of N numbers.
pub fn rows<'a, const N: usize>(array: &'a Input<'_>) -> PyResult<&'a [[f64; N]]> {
    check_rows::<N>(array.is_c_contiguous(), array.shape())?;
    Ok(array.as_slice()?.as_chunks().0)
}

/// The rows of N elements for writing.
///
/// # Errors
/// See [`rows`].
pub fn rows_mut<'a, T: Element, const N: usize>(
    array: &'a mut Output<'_, T>,
) -> PyResult<&'a mut [[T; N]]> {
    check_rows::<N>(array.is_c_contiguous(), array.shape())?;
    Ok(array.as_slice_mut()?.as_chunks_mut().0)
}

/// Computes an output row from each input row, without the interpreter's lock.
///
/// # Errors
/// If the arrays have different numbers of rows.
pub fn map_rows<const N: usize, const M: usize>(
    py: Python<'_>,
    input: &Input<'_>,
    output: &mut Output<'_>,
    work: impl Fn(&[f64; N]) -> [f64; M] + Sync,
) -> PyResult<()> {
    let (input, output) = (rows(input)?, rows_mut(output)?);
    check_same_length(input.len(), output.len())?;
    without_gil(py, || {
        for (input, output) in input.iter().zip(output) {
            *output = work(input);
        }
    })
}

/// Computes an output row from each pair of input rows, without the interpreter's lock.
///
/// # Errors
/// See [`map_rows`].
pub fn map_row_pairs<const N: usize, const K: usize, const M: usize>(
    py: Python<'_>,
    (first, second): (&Input<'_>, &Input<'_>),
    output: &mut Output<'_>,
    work: impl Fn(&[f64; N], &[f64; K]) -> [f64; M] + Sync,
) -> PyResult<()> {
    let (first, second, output) = (rows(first)?, rows(second)?, rows_mut(output)?);
    check_same_length(first.len(), second.len())?;
    check_same_length(first.len(), output.len())?;
    without_gil(py, || {
        for ((first, second), output) in first.iter().zip(second).zip(output) {
            *output = work(first, second);
        }
    })
}

/// Runs `work` without the interpreter's lock.
///
/// # Errors
/// If it panics.
pub fn without_gil(py: Python<'_>, work: impl FnOnce() + Send) -> PyResult<()> {
    py.detach(|| {
        catch_panic(|| {
            work();
            Ok(())
        })
    })
}

/// Checks that two arrays have the same number of rows.
///
/// # Errors
/// If they do not.
pub fn check_same_length(expected: usize, got: usize) -> PyResult<()> {
    if expected == got {
        return Ok(());
    }
    Err(argument_error("arrays", format!("{expected} rows"), got))
}

fn check_rows<const N: usize>(is_contiguous: bool, shape: &[usize]) -> PyResult<()> {
    if is_contiguous && shape.iter().product::<usize>().is_multiple_of(N) {
        return Ok(());
    }
    let expected = format!("rows of {N} numbers, one after the other");
    Err(argument_error(
        "array",
        expected,
        format!("shape {shape:?}"),
    ))
}

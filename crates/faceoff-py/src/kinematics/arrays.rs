//! NumPy's memory, as rows of numbers.

use crate::errors::{argument, fenced};
use numpy::{Element, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Numbers to be read.
pub type Given<'py> = PyReadonlyArrayDyn<'py, f64>;
/// Numbers, or flags, to be written.
pub type Made<'py, T = f64> = PyReadwriteArrayDyn<'py, T>;

/// Rows of N, in order, of all leading dimensions.
///
/// # Errors
/// If the array does not lie in one piece, row after row, or does not end in whole rows.
pub fn rows<'a, const N: usize>(array: &'a Given<'_>) -> PyResult<&'a [[f64; N]]> {
    check::<N>(array.is_c_contiguous(), array.shape())?;
    Ok(array.as_slice()?.as_chunks().0)
}

/// The same, to be written.
///
/// # Errors
/// As of [`rows`].
pub fn rows_mut<'a, T: Element, const N: usize>(
    array: &'a mut Made<'_, T>,
) -> PyResult<&'a mut [[T; N]]> {
    check::<N>(array.is_c_contiguous(), array.shape())?;
    Ok(array.as_slice_mut()?.as_chunks_mut().0)
}

/// Writes a row for each that is given, while the interpreter does something else.
///
/// # Errors
/// If there are not as many rows to write as to read.
pub fn each<const N: usize, const M: usize>(
    py: Python<'_>,
    given: &Given<'_>,
    made: &mut Made<'_>,
    work: impl Fn(&[f64; N]) -> [f64; M] + Sync,
) -> PyResult<()> {
    let (given, made) = (rows(given)?, rows_mut(made)?);
    same_length(given.len(), made.len())?;
    detached(py, || {
        for (given, made) in given.iter().zip(made) {
            *made = work(given);
        }
    })
}

/// The same of two.
///
/// # Errors
/// As of [`each`].
pub fn each_pair<const N: usize, const K: usize, const M: usize>(
    py: Python<'_>,
    (first, second): (&Given<'_>, &Given<'_>),
    made: &mut Made<'_>,
    work: impl Fn(&[f64; N], &[f64; K]) -> [f64; M] + Sync,
) -> PyResult<()> {
    let (first, second, made) = (rows(first)?, rows(second)?, rows_mut(made)?);
    same_length(first.len(), second.len())?;
    same_length(first.len(), made.len())?;
    detached(py, || {
        for ((first, second), made) in first.iter().zip(second).zip(made) {
            *made = work(first, second);
        }
    })
}

/// Does it without the interpreter's lock.
///
/// # Errors
/// If it panics.
pub fn detached(py: Python<'_>, work: impl FnOnce() + Send) -> PyResult<()> {
    py.detach(|| {
        fenced(|| {
            work();
            Ok(())
        })
    })
}

/// # Errors
/// If two arrays do not have as many rows.
pub fn same_length(expected: usize, got: usize) -> PyResult<()> {
    if expected == got {
        return Ok(());
    }
    Err(argument("arrays", format!("{expected} rows"), got))
}

fn check<const N: usize>(in_order: bool, shape: &[usize]) -> PyResult<()> {
    if in_order && shape.iter().product::<usize>().is_multiple_of(N) {
        return Ok(());
    }
    let expected = format!("rows of {N} numbers, one after the other");
    Err(argument("array", expected, format!("shape {shape:?}")))
}

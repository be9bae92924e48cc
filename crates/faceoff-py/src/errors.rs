//! What goes wrong, as Python's exceptions.

use pyo3::{import_exception, prelude::*};
use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

import_exception!(faceoff.errors, Error);
import_exception!(faceoff.errors, ArgumentError);
import_exception!(faceoff.errors, OrderError);
import_exception!(faceoff.errors, ClosedError);

/// Runs what may panic: `PanicException` is no `Exception`, and would pass by the handlers of those who
/// call us.
///
/// # Errors
/// The closure's, or [`Error`] with the panic's words.
pub fn fenced<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result,
        Err(panic) => Err(broken(&words(panic.as_ref()))),
    }
}

/// The error of a simulator that failed.
pub fn broken(words: &str) -> PyErr {
    Error::new_err(format!(
        "the simulator failed, which is a fault of faceoff: {words}; make a new environment, and please report it"
    ))
}

/// What a panic says of itself.
pub fn words(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<&str>()
        .map(|words| (*words).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned())
}

/// An argument that cannot be.
pub fn argument(
    name: &str,
    expected: impl std::fmt::Display,
    got: impl std::fmt::Display,
) -> PyErr {
    ArgumentError::new_err(format!("{name}: expected {expected}, got {got}"))
}

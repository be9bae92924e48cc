//! Errors as Python exceptions: the classes of the package's `errors.py`.

use faceoff_airhockey::checked_magnitudes;
use faceoff_sim::PerturbationSettings;
use faceoff_types::Magnitudes;
use pyo3::{import_exception, prelude::*};
use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

import_exception!(faceoff.errors, Error);
import_exception!(faceoff.errors, ArgumentError);
import_exception!(faceoff.errors, OrderError);
import_exception!(faceoff.errors, ClosedError);

/// Runs `work` and converts a panic to an error: `PanicException` is not an `Exception`, so callers' handlers would
/// not catch it.
///
/// # Errors
/// The closure's error, or [`Error`] with the panic's message.
pub fn catch_panic<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result,
        Err(panic) => Err(simulator_error(&panic_message(panic.as_ref()))),
    }
}

/// The error of a simulator that failed.
pub fn simulator_error(message: &str) -> PyErr {
    Error::new_err(format!(
        "the simulator failed, which is a fault of faceoff: {message}; make a new environment, and please report it"
    ))
}

/// The message of a panic.
pub fn panic_message(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<&str>()
        .map(|message| (*message).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without a message".to_owned())
}

/// Refuses magnitudes of perturbations that are outside of their ranges.
pub fn check_perturbations(settings: &PerturbationSettings) -> PyResult<Magnitudes> {
    checked_magnitudes(settings)
        .map_err(|error| argument_error("perturbations", "valid magnitudes", error))
}

/// The error of an invalid argument.
pub fn argument_error(
    name: &str,
    expected: impl std::fmt::Display,
    got: impl std::fmt::Display,
) -> PyErr {
    ArgumentError::new_err(format!("{name}: expected {expected}, got {got}"))
}

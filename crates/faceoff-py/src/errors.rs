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

/// The error of a call after `close()`.
pub fn closed_error() -> PyErr {
    ClosedError::new_err("expected an open environment, got one that was closed: make a new one")
}

/// The error of a call before the first `reset()`.
pub fn missing_reset_error() -> PyErr {
    OrderError::new_err("expected reset() first, got another call")
}

/// Borrows an object whose methods run for one thread at a time.
///
/// # Errors
/// If another thread runs one.
pub fn borrow_mut<'py, T>(object: &Bound<'py, T>) -> PyResult<PyRefMut<'py, T>>
where
    T: pyo3::PyClass<Frozen = pyo3::pyclass::boolean_struct::False>,
{
    object.try_borrow_mut().map_err(|_| {
        OrderError::new_err(
            "expected one call at a time, got one while another thread's is under way",
        )
    })
}

/// Refuses a pickled state of another version of this package, whose simulator may compute other states.
///
/// # Errors
/// If `version` is not this one.
pub fn check_version(version: &str) -> PyResult<()> {
    let own = env!("CARGO_PKG_VERSION");
    if version == own {
        return Ok(());
    }
    Err(argument_error(
        "state",
        format!(
            "one pickled by this version of faceoff, {own}, which alone plays it again exactly"
        ),
        format!(
            "one of version {}",
            faceoff_types::escape_unprintable(version)
        ),
    ))
}

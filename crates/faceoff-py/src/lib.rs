//! The native half of the Python package `faceoff`: the simulator and the evaluator, for programs in Python.
//!
//! This crate turns arguments into the types of the other crates, and their results into arrays. It
//! decides nothing about the simulation, and no panic of the other crates leaves it as one.

use pyo3::prelude::*;

/// `faceoff._native`; what users import is the Python package around it.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

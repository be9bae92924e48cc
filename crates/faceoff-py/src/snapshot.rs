//! The exact state of a world, to come back to.

use crate::{
    errors::{argument, fenced},
    setup::Setup,
    world::{Origin, World, check_puck},
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The exact state of a world. In memory it is a copy; pickled it is the episode and its actions so far, which are
/// played again when it is loaded.
#[pyclass(frozen, module = "faceoff._native")]
pub struct Snapshot {
    pub setup: Arc<Setup>,
    pub world: World,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    faceoff: String,
    setup: Setup,
    seed: u64,
    episode: u32,
    puck: Option<[f64; 6]>,
    actions: Vec<f64>,
}

#[pymethods]
impl Snapshot {
    /// What the environment plays: as it was made with.
    #[getter]
    fn seed(&self) -> u64 {
        self.world.origin.seed
    }

    /// The episode's number.
    #[getter]
    fn episode_number(&self) -> u32 {
        self.world.origin.number
    }

    /// Control steps played.
    #[getter]
    fn steps(&self) -> u32 {
        self.world.episode.steps()
    }

    fn __repr__(&self) -> String {
        format!(
            "<state of {}: seed {}, episode {}, step {}>",
            self.setup.task,
            self.world.origin.seed,
            self.world.origin.number,
            self.world.episode.steps()
        )
    }

    // A world that was started anew and played equally is the same, to the last bit.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let written = Written {
            faceoff: env!("CARGO_PKG_VERSION").to_owned(),
            setup: Setup::clone(&self.setup),
            seed: self.world.origin.seed,
            episode: self.world.origin.number,
            puck: self.world.origin.puck,
            actions: self.world.actions.clone(),
        };
        let json = serde_json::to_vec(&written)
            .map_err(|error| argument("state", "one that can be written", error))?;
        let load = py.import("faceoff._native")?.getattr("load_snapshot")?;
        Ok((load, (PyBytes::new(py, &json),)))
    }
}

/// Reads a pickled state and plays it again.
#[pyfunction]
pub fn load_snapshot(py: Python<'_>, data: &[u8]) -> PyResult<Snapshot> {
    let written: Written = serde_json::from_slice(data)
        .map_err(|error| argument("state", "one that faceoff has pickled", error))?;
    let here = env!("CARGO_PKG_VERSION");
    if written.faceoff != here {
        return Err(argument(
            "state",
            format!(
                "one pickled by this version of faceoff, {here}, which alone plays it again exactly"
            ),
            format!(
                "one of version {}",
                faceoff_types::harmless(&written.faceoff)
            ),
        ));
    }
    let setup = serde_json::to_string(&written.setup)
        .map_err(|error| argument("state", "a setup that can be read", error))?;
    let setup = Setup::read(&setup)?;
    if let Some(puck) = &written.puck {
        check_puck(setup.task, puck)?;
    }
    let origin = Origin {
        seed: written.seed,
        number: written.episode,
        puck: written.puck,
    };
    let world = py.detach(|| fenced(|| World::replay(&setup, origin, written.actions)))?;
    Ok(Snapshot {
        setup: Arc::new(setup),
        world,
    })
}

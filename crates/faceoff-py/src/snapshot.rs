//! Saved states of worlds.

use crate::{
    errors::{argument_error, catch_panic, check_version},
    setup::Setup,
    world::{EpisodeStart, World, check_puck},
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The exact state of a world. In memory it is a copy; pickled it is the episode with its actions so far, which are
/// simulated again on loading.
#[pyclass(frozen, module = "faceoff._native")]
pub struct Snapshot {
    pub setup: Arc<Setup>,
    pub world: World,
}

/// What a pickled state contains.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedState {
    /// The version of the package that wrote it.
    faceoff: String,
    setup: Setup,
    seed: u64,
    episode: u32,
    puck: Option<[f64; 6]>,
    actions: Vec<f64>,
}

#[pymethods]
impl Snapshot {
    /// The seed of the world.
    #[getter]
    fn seed(&self) -> u64 {
        self.world.episode_start.seed
    }

    /// The episode's number.
    #[getter]
    fn episode_number(&self) -> u32 {
        self.world.episode_start.number
    }

    /// Control steps after which the episode is truncated.
    #[getter]
    fn max_episode_steps(&self) -> u32 {
        self.setup.max_episode_steps
    }

    /// Control steps of the episode so far.
    #[getter]
    fn steps(&self) -> u32 {
        self.world.episode.steps()
    }

    fn __repr__(&self) -> String {
        format!(
            "<state of {}: seed {}, episode {}, step {}>",
            self.setup.task,
            self.world.episode_start.seed,
            self.world.episode_start.number,
            self.world.episode.steps()
        )
    }

    // A snapshot is immutable, so a copy is the same object.
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
        let saved = SavedState {
            faceoff: env!("CARGO_PKG_VERSION").to_owned(),
            setup: Setup::clone(&self.setup),
            seed: self.world.episode_start.seed,
            episode: self.world.episode_start.number,
            puck: self.world.episode_start.puck,
            actions: self.world.actions.clone(),
        };
        let json = serde_json::to_vec(&saved)
            .map_err(|error| argument_error("state", "a state that can be serialised", error))?;
        let load = py.import("faceoff._native")?.getattr("load_snapshot")?;
        Ok((load, (PyBytes::new(py, &json),)))
    }
}

/// Loads a pickled state by simulating its episode again.
#[pyfunction]
pub fn load_snapshot(py: Python<'_>, data: &[u8]) -> PyResult<Snapshot> {
    let saved: SavedState = serde_json::from_slice(data)
        .map_err(|error| argument_error("state", "a state pickled by faceoff", error))?;
    check_version(&saved.faceoff)?;
    let setup = serde_json::to_string(&saved.setup)
        .map_err(|error| argument_error("state", "a valid setup", error))?;
    let setup = Setup::read(&setup)?;
    if let Some(puck) = &saved.puck {
        check_puck(setup.task, puck)?;
    }
    let episode_start = EpisodeStart {
        seed: saved.seed,
        number: saved.episode,
        puck: saved.puck,
    };
    let world =
        py.detach(|| catch_panic(|| World::replay(&setup, episode_start, saved.actions)))?;
    Ok(Snapshot {
        setup: Arc::new(setup),
        world,
    })
}

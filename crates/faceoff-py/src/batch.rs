//! The simulator's batch, which steps many worlds together without the environments of this package. Benchmarks measure by it how much
//! time the environments add.

use crate::errors::{argument_error, catch_panic, simulator_error};
use faceoff_sim::{
    ActivePerturbations, Batch as SimBatch, BatchSetup, Interpolation, JOINTS,
    PerturbationSettings, Plant, model::INITIAL_Q,
};
use faceoff_types::Seed;
use pyo3::prelude::*;
use rayon::ThreadPool;

/// A batch of worlds whose arms hold still.
#[pyclass(module = "faceoff._native")]
pub struct Batch {
    batch: SimBatch,
    actions: Vec<f64>,
    pool: ThreadPool,
}

#[pymethods]
impl Batch {
    /// Worlds of the ideal simulator, with cubic interpolation.
    #[new]
    fn new(task: &str, worlds: u32, threads: usize) -> PyResult<Self> {
        let task = task
            .parse()
            .map_err(|_| argument_error("task", "hit, defend or prepare", task))?;
        let hold_action = Interpolation::Cubic.hold_position(&INITIAL_Q);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        catch_panic(|| {
            Ok(Self {
                batch: SimBatch::new(BatchSetup {
                    task,
                    interpolation: Interpolation::Cubic,
                    active_perturbations: ActivePerturbations::NONE,
                    settings: PerturbationSettings::default(),
                    plant: Plant::nominal(),
                    seed: Seed::from_number(0),
                    worlds,
                }),
                // An action of the cubic interpolation: positions and velocities.
                actions: hold_action[..2 * JOINTS].repeat(worlds as usize),
                pool: pool.map_err(|error| simulator_error(&error.to_string()))?,
            })
        })
    }

    /// A control step of all worlds.
    fn step(&mut self, py: Python<'_>) -> PyResult<()> {
        let Self {
            batch,
            actions,
            pool,
        } = self;
        py.detach(|| {
            catch_panic(|| {
                pool.install(|| {
                    batch.step(actions);
                });
                Ok(())
            })
        })
    }
}

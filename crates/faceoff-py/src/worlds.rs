//! The worlds of an environment, driven by the Python half. A *world* is one simulated table with its running episode.

use crate::{
    errors::{
        OrderError, argument_error, borrow_mut, catch_panic, closed_error, missing_reset_error,
        panic_message, simulator_error,
    },
    numpy_outputs::NumpyOutputs,
    outputs::{OwnedOutputs, chunks_with_worlds},
    pool::{Pool, pool_if_parallel},
    setup::Setup,
    snapshot::Snapshot,
    step::{Autoreset, step},
    world::{EpisodeStart, World, check_puck},
};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    process,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, channel},
    },
};

/// Number of worlds that the simulator computes in one SIMD register; threads work on chunks of a multiple of it.
const LANES: usize = 4;
/// Chunks per thread, for balancing: worlds take different times.
const CHUNKS_PER_THREAD: usize = 4;

/// Worlds of one setup, for environments of one world or of many.
#[pyclass(module = "faceoff._native")]
pub struct Worlds {
    setup: Arc<Setup>,
    autoreset: Autoreset,
    /// Number of worlds.
    count: usize,
    pool: Pool,
    state: State,
}

enum State {
    /// No step is running; empty before the first reset.
    Idle(Vec<World>),
    /// A step that was sent is running.
    Sent(SentStep),
    Closed,
    /// A step panicked.
    Failed,
}

/// A step that runs in the pool's threads.
struct SentStep {
    /// The process that sent it; a forked one has no copy of the threads.
    process_id: u32,
    result: Mutex<Receiver<Result<StepOutput, String>>>,
}

/// Worlds after a step, and its results.
type StepOutput = (Vec<World>, OwnedOutputs);

#[pymethods]
impl Worlds {
    /// Arguments were checked by the Python half. The first reset creates the worlds.
    #[new]
    fn new(setup: &str, count: usize, threads: usize, autoreset: &str) -> PyResult<Self> {
        if count == 0 || threads == 0 {
            return Err(argument_error("num_envs, threads", "at least 1", 0));
        }
        Ok(Self {
            setup: Arc::new(Setup::read(setup)?),
            autoreset: Autoreset::read(autoreset)?,
            count,
            pool: Pool::new(threads),
            state: State::Idle(Vec::new()),
        })
    }

    /// Resets the worlds for which `mask` is true to episode `number` of their seed, or without a seed to the episode after the last
    /// one. Rows of other worlds are not written.
    fn reset(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        seeds: Vec<Option<u64>>,
        number: Option<u32>,
        puck: Option<[f64; 6]>,
        mut rows: NumpyOutputs<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let setup = &*this.setup;
        let mut outputs = rows.outputs(this.count, setup.observation_len())?;
        let mask = mask.as_slice()?;
        if mask.len() != this.count || seeds.len() != this.count {
            let expected = format!("one for each of {} worlds", this.count);
            return Err(argument_error("mask, seeds", expected, mask.len()));
        }
        if let Some(puck) = &puck {
            check_puck(setup.task, puck)?;
        }
        let worlds = this.state.idle_worlds()?;
        if worlds.is_empty() && (mask.contains(&false) || seeds.contains(&None)) {
            return Err(OrderError::new_err(
                "reset: expected a reset of all worlds first, got one of some",
            ));
        }
        let episode_start = |index: usize, world: Option<&World>| EpisodeStart {
            seed: seeds[index].unwrap_or_else(|| world.map_or(0, |world| world.episode_start.seed)),
            number: number.unwrap_or_else(|| match (seeds[index], world) {
                (None, Some(world)) => world.episode_start.number.wrapping_add(1),
                _ => 0,
            }),
            puck,
        };
        let pool = pool_if_parallel(&mut this.pool)?;
        let started: Vec<Option<World>> = py.detach(|| {
            catch_panic(|| {
                let start = |index: usize| {
                    let world = worlds.get(index);
                    mask[index].then(|| World::start(setup, episode_start(index, world), world))
                };
                Ok(match pool {
                    None => (0..mask.len()).map(start).collect(),
                    Some(pool) => {
                        pool.install(|| (0..mask.len()).into_par_iter().map(start).collect())
                    }
                })
            })
        })?;
        let mut worlds_after = Vec::with_capacity(started.len());
        let mut previous = std::mem::take(worlds).into_iter();
        for (row, started) in started.into_iter().enumerate() {
            let previous = previous.next();
            let is_new = started.is_some();
            let Some(world) = started.or(previous) else {
                return Err(simulator_error("a world is missing"));
            };
            if is_new {
                outputs.write_start(row, &world);
            }
            worlds_after.push(world);
        }
        *worlds = worlds_after;
        Ok(())
    }

    /// One control step of every world; `actions` is [worlds][action]. The interpreter's lock is released.
    fn step(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, f64>,
        mut rows: NumpyOutputs<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let mut outputs = rows.outputs(this.count, this.setup.observation_len())?;
        let actions = this.check_actions(&actions)?;
        let pool = pool_if_parallel(&mut this.pool)?;
        let (setup, autoreset) = (&*this.setup, this.autoreset);
        let worlds = this.state.idle_worlds()?;
        // A panic leaves worlds in the middle of a step, so all of them become unusable.
        let stepped = py.detach(|| {
            catch_panic(|| {
                match pool {
                    None => step(setup, autoreset, worlds, actions, &mut outputs),
                    Some(pool) => {
                        let chunk_size = worlds_per_chunk(worlds.len(), pool.current_num_threads());
                        let action_len = setup.action_format().len();
                        pool.install(|| {
                            chunks_with_worlds(worlds, outputs, chunk_size)
                                .zip(actions.par_chunks(chunk_size * action_len))
                                .for_each(|((worlds, mut outputs), actions)| {
                                    step(setup, autoreset, worlds, actions, &mut outputs);
                                });
                        });
                    }
                }
                Ok(())
            })
        });
        if stepped.is_err() {
            this.state = State::Failed;
        }
        stepped
    }

    /// Begins a step in the background; [`Self::recv`] waits for it. `states`: also return the true states of the worlds.
    fn send(
        slf: &Bound<'_, Self>,
        actions: PyReadonlyArray2<'_, f64>,
        states: bool,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let actions = this.check_actions(&actions)?.to_vec();
        let pool = this.pool.get_or_start()?;
        let (setup, autoreset) = (Arc::clone(&this.setup), this.autoreset);
        let mut worlds = std::mem::take(this.state.idle_worlds()?);
        let (sender, result) = channel();
        let chunk_size = worlds_per_chunk(worlds.len(), pool.current_num_threads());
        pool.spawn(move || {
            let work = || {
                let mut owned = OwnedOutputs::new(&setup, worlds.len(), states);
                let action_len = setup.action_format().len();
                chunks_with_worlds(&mut worlds, owned.outputs(), chunk_size)
                    .zip(actions.par_chunks(chunk_size * action_len))
                    .for_each(|((worlds, mut outputs), actions)| {
                        step(&setup, autoreset, worlds, actions, &mut outputs);
                    });
                (worlds, owned)
            };
            let stepped = catch_unwind(AssertUnwindSafe(work));
            // The receiver is gone if the environment was closed meanwhile.
            let _ = sender.send(stepped.map_err(|panic| panic_message(panic.as_ref())));
        });
        this.state = State::Sent(SentStep {
            process_id: process::id(),
            result: Mutex::new(result),
        });
        Ok(())
    }

    /// Waits for the step that was sent.
    fn recv(slf: &Bound<'_, Self>, py: Python<'_>, mut rows: NumpyOutputs<'_>) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let mut outputs = rows.outputs(this.count, this.setup.observation_len())?;
        let (worlds, owned) = this.state.receive(py)?;
        owned.copy_to(&mut outputs);
        this.state = State::Idle(worlds);
        Ok(())
    }

    /// The exact state of a world.
    fn save(slf: &Bound<'_, Self>, index: usize) -> PyResult<Snapshot> {
        let this = &mut *borrow_mut(slf)?;
        let setup = Arc::clone(&this.setup);
        let world = this.world(index)?.clone();
        Ok(Snapshot { setup, world })
    }

    /// Restores a state that was saved in an environment with the same setup, and writes the world's row.
    fn restore(
        slf: &Bound<'_, Self>,
        index: usize,
        snapshot: &Bound<'_, Snapshot>,
        mut rows: NumpyOutputs<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let snapshot = snapshot.get();
        let (count, len) = (this.count, this.setup.observation_len());
        if *snapshot.setup != *this.setup {
            return Err(argument_error(
                "state",
                "one of an environment with the same task, actions, interpolation, perturbations and horizon",
                "one of another environment",
            ));
        }
        let mut outputs = rows.outputs(count, len)?;
        let worlds = this.state.idle_worlds()?;
        if worlds.is_empty() && count == 1 {
            worlds.push(snapshot.world.clone());
        }
        let world = this.world(index)?;
        world.clone_from(&snapshot.world);
        outputs.write_start(index, world);
        Ok(())
    }

    /// The seed and episode number of each world.
    fn origins(slf: &Bound<'_, Self>) -> PyResult<Vec<(u64, u32)>> {
        let this = &mut *borrow_mut(slf)?;
        let worlds = this.state.idle_worlds()?;
        let episode_start = |world: &World| (world.episode_start.seed, world.episode_start.number);
        Ok(worlds.iter().map(episode_start).collect())
    }

    /// The true state of a world, see [`crate::world::STATE_LEN`].
    fn state(slf: &Bound<'_, Self>, index: usize) -> PyResult<Vec<f64>> {
        let this = &mut *borrow_mut(slf)?;
        Ok(this.world(index)?.state().to_vec())
    }

    /// Whether a step that was sent is running.
    #[getter]
    fn is_sent(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(matches!(borrow_mut(slf)?.state, State::Sent(_)))
    }

    /// Number of threads of the pool.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(borrow_mut(slf)?.pool.threads())
    }

    /// Releases worlds and threads. Later calls are refused.
    fn close(slf: &Bound<'_, Self>) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        this.state = State::Closed;
        this.pool = Pool::new(this.pool.threads());
        Ok(())
    }
}

impl Worlds {
    fn check_actions<'a>(&self, actions: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [f64]> {
        let action_format = self.setup.action_format();
        if actions.shape() != [self.count, action_format.len()] {
            return Err(argument_error(
                "action",
                format!(
                    "an array of shape ({}, {})",
                    self.count,
                    action_format.len()
                ),
                format!("one of shape {:?}", actions.shape()),
            ));
        }
        let actions = actions.as_slice()?;
        let is_single = self.count == 1;
        action_format.check(actions, |index| {
            if is_single {
                String::new()
            } else {
                format!(" of world {index}")
            }
        })?;
        if let State::Idle(worlds) = &self.state {
            check_call_order(worlds, self.autoreset)?;
        }
        Ok(actions)
    }

    fn world(&mut self, index: usize) -> PyResult<&mut World> {
        let count = self.count;
        let worlds = self.state.idle_worlds()?;
        if worlds.is_empty() {
            return Err(missing_reset_error());
        }
        worlds
            .get_mut(index)
            .ok_or_else(|| argument_error("index", format!("below {count}"), index))
    }
}

impl State {
    fn idle_worlds(&mut self) -> PyResult<&mut Vec<World>> {
        match self {
            Self::Idle(worlds) => Ok(worlds),
            Self::Sent(_) => Err(OrderError::new_err(
                "expected recv() of the step that was sent, got another call",
            )),
            Self::Closed => Err(closed_error()),
            Self::Failed => Err(simulator_error("an earlier step failed")),
        }
    }

    fn receive(&mut self, py: Python<'_>) -> PyResult<StepOutput> {
        let Self::Sent(sent) = self else {
            self.idle_worlds()?;
            return Err(OrderError::new_err(
                "recv: expected a step that was sent, got none: call send() first",
            ));
        };
        if sent.process_id != process::id() {
            return Err(OrderError::new_err(
                "recv: expected a step that this process sent, got one of the process that it was forked from, whose \
                 threads are not here: make a new environment",
            ));
        }
        let result = &sent.result;
        let received = py.detach(|| {
            let result = result.lock().unwrap_or_else(PoisonError::into_inner);
            result.recv()
        });
        let message = match received {
            Ok(Ok(output)) => return Ok(output),
            Ok(Err(message)) => message,
            Err(_) => "the step was aborted".to_owned(),
        };
        *self = Self::Failed;
        Err(simulator_error(&message))
    }
}

fn check_call_order(worlds: &[World], autoreset: Autoreset) -> PyResult<()> {
    if worlds.is_empty() {
        return Err(missing_reset_error());
    }
    if autoreset != Autoreset::Disabled {
        return Ok(());
    }
    match worlds.iter().position(|world| world.end.is_some()) {
        None => Ok(()),
        Some(_) if worlds.len() == 1 => Err(OrderError::new_err(
            "step: expected an episode under way, got one that has ended: call reset() first",
        )),
        Some(index) => Err(OrderError::new_err(format!(
            "step: expected episodes under way, but that of world {index} has ended: call \
             reset(options={{\"reset_mask\": mask}}) first"
        ))),
    }
}

fn worlds_per_chunk(worlds: usize, threads: usize) -> usize {
    worlds
        .div_ceil(threads * CHUNKS_PER_THREAD)
        .next_multiple_of(LANES)
}

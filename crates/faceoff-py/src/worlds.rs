//! The worlds of an environment, as Python's half drives them.

use crate::{
    errors::{ClosedError, OrderError, argument, broken, fenced, words},
    outputs::{OwnRows, with_worlds},
    pool::Pool,
    rows::Rows,
    setup::Setup,
    snapshot::Snapshot,
    step::{Autoreset, step},
    world::{Origin, World, check_puck},
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

/// Lanes in which worlds are stepped: a thread's piece is a multiple of it.
const LANES: usize = 4;
/// Pieces per thread, so that one whose worlds take longer does not keep the others waiting.
const PIECES_PER_THREAD: usize = 4;

/// Worlds of one setup; environments of one world and of many are both made of them.
#[pyclass(module = "faceoff._native")]
pub struct Worlds {
    setup: Arc<Setup>,
    autoreset: Autoreset,
    count: usize,
    pool: Pool,
    state: State,
}

enum State {
    /// Nothing is under way; no worlds before the first reset.
    Idle(Vec<World>),
    /// A step that was sent.
    Sent(Sent),
    Closed,
    /// A step panicked.
    Broken,
}

struct Sent {
    by_process: u32,
    result: Mutex<Receiver<Result<Stepped, String>>>,
}

/// Worlds after a step, and what it led to.
type Stepped = (Vec<World>, OwnRows);

#[pymethods]
impl Worlds {
    /// Checked arguments of Python's half; worlds come with the first reset.
    #[new]
    fn new(setup: &str, count: usize, threads: usize, autoreset: &str) -> PyResult<Self> {
        let autoreset = match autoreset {
            "next_step" => Autoreset::NextStep,
            "same_step" => Autoreset::SameStep,
            "disabled" => Autoreset::Disabled,
            other => return Err(argument("autoreset_mode", "an AutoresetMode", other)),
        };
        if count == 0 || threads == 0 {
            return Err(argument("num_envs, threads", "at least 1", 0));
        }
        Ok(Self {
            setup: Arc::new(Setup::read(setup)?),
            autoreset,
            count,
            pool: Pool::new(threads),
            state: State::Idle(Vec::new()),
        })
    }

    /// Resets the worlds of the mask: to the given episode of the given seed, or without a seed to the episode after
    /// the last one. Rows of others are not written.
    fn reset(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        seeds: Vec<Option<u64>>,
        number: Option<u32>,
        puck: Option<[f64; 6]>,
        mut rows: Rows<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        let setup = &*this.setup;
        let mut outputs = rows.outputs(this.count, setup.observation_len())?;
        let mask = mask.as_slice()?;
        if mask.len() != this.count || seeds.len() != this.count {
            let expected = format!("one for each of {} worlds", this.count);
            return Err(argument("mask, seeds", expected, mask.len()));
        }
        if let Some(puck) = &puck {
            check_puck(setup.task, puck)?;
        }
        let worlds = this.state.idle()?;
        if worlds.is_empty() && (mask.contains(&false) || seeds.contains(&None)) {
            return Err(OrderError::new_err(
                "reset: expected a reset of all worlds first, got one of some",
            ));
        }
        let origin = |index: usize, world: Option<&World>| Origin {
            seed: seeds[index].unwrap_or_else(|| world.map_or(0, |world| world.origin.seed)),
            number: number.unwrap_or_else(|| match (seeds[index], world) {
                (None, Some(world)) => world.origin.number.wrapping_add(1),
                _ => 0,
            }),
            puck,
        };
        let pool = threads(&mut this.pool)?;
        let started: Vec<Option<World>> = py.detach(|| {
            fenced(|| {
                let start = |index: usize| {
                    let world = worlds.get(index);
                    mask[index].then(|| World::start(setup, origin(index, world), world))
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
        let mut before = std::mem::take(worlds).into_iter();
        for (row, started) in started.into_iter().enumerate() {
            let before = before.next();
            let is_new = started.is_some();
            let Some(world) = started.or(before) else {
                return Err(broken("a world is missing"));
            };
            if is_new {
                outputs.write_start(row, &world);
            }
            worlds_after.push(world);
        }
        *worlds = worlds_after;
        Ok(())
    }

    /// One control step of every world; `actions` is [worlds][action]. The interpreter is free meanwhile.
    fn step(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, f64>,
        mut rows: Rows<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        let mut outputs = rows.outputs(this.count, this.setup.observation_len())?;
        let actions = this.checked(&actions)?;
        let pool = threads(&mut this.pool)?;
        let (setup, autoreset) = (&*this.setup, this.autoreset);
        let worlds = this.state.idle()?;
        // As much as a step of all worlds: a panic leaves them in the middle of it.
        let stepped = py.detach(|| {
            fenced(|| {
                match pool {
                    None => step(setup, autoreset, worlds, actions, &mut outputs),
                    Some(pool) => {
                        let at_a_time = worlds_at_a_time(worlds.len(), pool.current_num_threads());
                        let len = setup.interpolation.len();
                        pool.install(|| {
                            with_worlds(worlds, outputs, at_a_time)
                                .zip(actions.par_chunks(at_a_time * len))
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
            this.state = State::Broken;
        }
        stepped
    }

    /// Begins a step, which goes on while Python does something else; [`Self::recv`] ends it.
    fn send(
        slf: &Bound<'_, Self>,
        actions: PyReadonlyArray2<'_, f64>,
        states: bool,
    ) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        let actions = this.checked(&actions)?.to_vec();
        let pool = this.pool.here()?;
        let (setup, autoreset) = (Arc::clone(&this.setup), this.autoreset);
        let mut worlds = std::mem::take(this.state.idle()?);
        let (sender, result) = channel();
        let at_a_time = worlds_at_a_time(worlds.len(), pool.current_num_threads());
        pool.spawn(move || {
            let work = || {
                let mut own = OwnRows::new(&setup, worlds.len(), states);
                let len = setup.interpolation.len();
                with_worlds(&mut worlds, own.rows(), at_a_time)
                    .zip(actions.par_chunks(at_a_time * len))
                    .for_each(|((worlds, mut outputs), actions)| {
                        step(&setup, autoreset, worlds, actions, &mut outputs);
                    });
                (worlds, own)
            };
            let stepped = catch_unwind(AssertUnwindSafe(work));
            // Nobody receives it if the environment was closed meanwhile.
            let _ = sender.send(stepped.map_err(|panic| words(panic.as_ref())));
        });
        this.state = State::Sent(Sent {
            by_process: process::id(),
            result: Mutex::new(result),
        });
        Ok(())
    }

    /// Waits for the step that was sent.
    fn recv(slf: &Bound<'_, Self>, py: Python<'_>, mut rows: Rows<'_>) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        let mut outputs = rows.outputs(this.count, this.setup.observation_len())?;
        let (worlds, own) = this.state.received(py)?;
        own.copy_to(&mut outputs);
        this.state = State::Idle(worlds);
        Ok(())
    }

    /// The exact state of a world.
    fn save(slf: &Bound<'_, Self>, index: usize) -> PyResult<Snapshot> {
        let this = &mut *borrow(slf)?;
        let setup = Arc::clone(&this.setup);
        let world = this.world(index)?.clone();
        Ok(Snapshot { setup, world })
    }

    /// Brings a world to a state that was saved of an environment with the same setup, and writes its row.
    fn restore(
        slf: &Bound<'_, Self>,
        index: usize,
        snapshot: &Bound<'_, Snapshot>,
        mut rows: Rows<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        let snapshot = snapshot.get();
        let (count, len) = (this.count, this.setup.observation_len());
        if *snapshot.setup != *this.setup {
            return Err(argument(
                "state",
                "one of an environment with the same task, actions, interpolation, perturbations and horizon",
                "one of another environment",
            ));
        }
        let mut outputs = rows.outputs(count, len)?;
        let worlds = this.state.idle()?;
        if worlds.is_empty() && count == 1 {
            worlds.push(snapshot.world.clone());
        }
        let world = this.world(index)?;
        world.clone_from(&snapshot.world);
        outputs.write_start(index, world);
        Ok(())
    }

    /// Which seed and episode each world plays.
    fn origins(slf: &Bound<'_, Self>) -> PyResult<Vec<(u64, u32)>> {
        let this = &mut *borrow(slf)?;
        let worlds = this.state.idle()?;
        let of = |world: &World| (world.origin.seed, world.origin.number);
        Ok(worlds.iter().map(of).collect())
    }

    /// The true state of a world, see [`crate::world::STATE_LEN`].
    fn state(slf: &Bound<'_, Self>, index: usize) -> PyResult<Vec<f64>> {
        let this = &mut *borrow(slf)?;
        Ok(this.world(index)?.state().to_vec())
    }

    /// Is a step under way that was sent?
    #[getter]
    fn is_sent(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(matches!(borrow(slf)?.state, State::Sent(_)))
    }

    /// Threads of the pool.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(borrow(slf)?.pool.threads())
    }

    /// Gives up worlds and threads. What is used afterwards is refused.
    fn close(slf: &Bound<'_, Self>) -> PyResult<()> {
        let this = &mut *borrow(slf)?;
        this.state = State::Closed;
        this.pool = Pool::new(this.pool.threads());
        Ok(())
    }
}

impl Worlds {
    fn checked<'a>(&self, actions: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [f64]> {
        let reader = self.setup.actions();
        if actions.shape() != [self.count, reader.len()] {
            return Err(argument(
                "action",
                format!("an array of shape ({}, {})", self.count, reader.len()),
                format!("one of shape {:?}", actions.shape()),
            ));
        }
        let actions = actions.as_slice()?;
        let alone = self.count == 1;
        reader.check(actions, |at| {
            if alone {
                String::new()
            } else {
                format!(" of world {at}")
            }
        })?;
        if let State::Idle(worlds) = &self.state {
            check_order(worlds, self.autoreset)?;
        }
        Ok(actions)
    }

    fn world(&mut self, index: usize) -> PyResult<&mut World> {
        let count = self.count;
        let worlds = self.state.idle()?;
        if worlds.is_empty() {
            return Err(never_reset());
        }
        worlds
            .get_mut(index)
            .ok_or_else(|| argument("index", format!("below {count}"), index))
    }
}

impl State {
    fn idle(&mut self) -> PyResult<&mut Vec<World>> {
        match self {
            Self::Idle(worlds) => Ok(worlds),
            Self::Sent(_) => Err(OrderError::new_err(
                "expected recv() of the step that was sent, got another call",
            )),
            Self::Closed => Err(ClosedError::new_err(
                "expected an open environment, got one that was closed: make a new one",
            )),
            Self::Broken => Err(broken("an earlier step did")),
        }
    }

    fn received(&mut self, py: Python<'_>) -> PyResult<Stepped> {
        let Self::Sent(sent) = self else {
            self.idle()?;
            return Err(OrderError::new_err(
                "recv: expected a step that was sent, got none: call send() first",
            ));
        };
        if sent.by_process != process::id() {
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
        let words = match received {
            Ok(Ok(both)) => return Ok(both),
            Ok(Err(words)) => words,
            Err(_) => "the step was given up".to_owned(),
        };
        *self = Self::Broken;
        Err(broken(&words))
    }
}

fn check_order(worlds: &[World], autoreset: Autoreset) -> PyResult<()> {
    if worlds.is_empty() {
        return Err(never_reset());
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

fn never_reset() -> PyErr {
    OrderError::new_err("expected reset() first, got another call")
}

/// The pool, or none where one thread does all: the caller's own is as good.
fn threads(pool: &mut Pool) -> PyResult<Option<&rayon::ThreadPool>> {
    match pool.threads() {
        1 => Ok(None),
        _ => pool.here().map(Some),
    }
}

fn worlds_at_a_time(worlds: usize, threads: usize) -> usize {
    worlds
        .div_ceil(threads * PIECES_PER_THREAD)
        .next_multiple_of(LANES)
}

fn borrow<'py>(worlds: &Bound<'py, Worlds>) -> PyResult<PyRefMut<'py, Worlds>> {
    worlds.try_borrow_mut().map_err(|_| {
        OrderError::new_err(
            "expected one call at a time, got one while another thread's is under way",
        )
    })
}

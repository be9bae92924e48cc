//! The thread pool of an environment, which also works in a forked process.

use crate::errors::simulator_error;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{mem, process};

/// A thread pool that each process starts on first use.
///
/// A forked process inherits a pool's memory without its threads. Submitting work to that pool, or dropping it, would
/// block forever, so it is leaked.
#[derive(Debug)]
pub struct Pool {
    threads: usize,
    /// The started pool, and the id of the process that started it.
    pool: Option<(u32, ThreadPool)>,
}

impl Pool {
    /// A pool of `threads` threads, not yet started.
    pub const fn new(threads: usize) -> Self {
        Self {
            threads,
            pool: None,
        }
    }

    /// The number of threads.
    pub const fn threads(&self) -> usize {
        self.threads
    }

    /// The pool of this process, started if necessary.
    ///
    /// # Errors
    /// If the system cannot start threads.
    pub fn get_or_start(&mut self) -> PyResult<&ThreadPool> {
        self.forget_inherited();
        let pool = match self.pool.take() {
            Some((_, pool)) => pool,
            None => ThreadPoolBuilder::new()
                .num_threads(self.threads)
                .thread_name(|index| format!("faceoff-{index}"))
                .build()
                .map_err(|error| simulator_error(&error.to_string()))?,
        };
        let (_, pool) = self.pool.insert((process::id(), pool));
        Ok(pool)
    }

    fn forget_inherited(&mut self) {
        if let Some((process_id, _)) = &self.pool
            && *process_id != process::id()
        {
            mem::forget(self.pool.take());
        }
    }
}

/// The pool, or `None` for a single thread, where the calling thread does the work.
///
/// # Errors
/// If the system cannot start threads.
pub fn pool_if_parallel(pool: &mut Pool) -> PyResult<Option<&ThreadPool>> {
    match pool.threads() {
        1 => Ok(None),
        _ => pool.get_or_start().map(Some),
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.forget_inherited();
    }
}

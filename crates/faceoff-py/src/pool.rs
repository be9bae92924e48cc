//! Threads of an environment's own.

use crate::errors::broken;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{mem, process};

/// A thread pool that is made when it is needed first, in each process anew.
///
/// A process that was forked has a pool's memory and none of its threads: whoever gave it work would wait for ever, and
/// so would whoever took it down. It is left where it is.
#[derive(Debug)]
pub struct Pool {
    threads: usize,
    made: Option<(u32, ThreadPool)>,
}

impl Pool {
    /// Of so many threads.
    pub const fn new(threads: usize) -> Self {
        Self {
            threads,
            made: None,
        }
    }

    /// Its number of threads.
    pub const fn threads(&self) -> usize {
        self.threads
    }

    /// This process's own.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn here(&mut self) -> PyResult<&ThreadPool> {
        self.leave_inherited();
        let pool = match self.made.take() {
            Some((_, pool)) => pool,
            None => ThreadPoolBuilder::new()
                .num_threads(self.threads)
                .thread_name(|index| format!("faceoff-{index}"))
                .build()
                .map_err(|error| broken(&error.to_string()))?,
        };
        let (_, pool) = self.made.insert((process::id(), pool));
        Ok(pool)
    }

    fn leave_inherited(&mut self) {
        if let Some((made_by, _)) = &self.made
            && *made_by != process::id()
        {
            mem::forget(self.made.take());
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.leave_inherited();
    }
}

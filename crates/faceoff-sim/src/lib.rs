//! The air-hockey simulator: two KUKA arms, a table and a puck, as the challenge's reference moves
//! them (MODEL).
//!
//! The arm's dynamics, its 1 kHz torque controller and the soft contacts follow the reference's
//! equations, so that trajectories agree with its recordings; a test holds each kind of recording.
//! Everything is deterministic: the same seed gives the same bits in debug and release builds and on
//! any number of threads. Sines and cosines are polynomials of its own, other transcendental functions come
//! from `libm`; none from the platform.
//!
//! This crate reads no clock and no environment and does no I/O. It knows neither agents as processes
//! nor scores.

#![expect(
    clippy::needless_range_loop,
    reason = "joints are numbered: one index runs over several arrays, as in the equations"
)]

pub mod batch;
pub mod channel;
pub mod dynamics;
pub mod episode;
pub mod export;
pub mod game;
pub mod golden;
pub mod model;
pub mod perturbation;
pub mod robot;
pub mod stream;
pub mod table;
mod together;
pub mod world;

pub use batch::{Batch, BatchOutcome, BatchSetup};
pub use channel::Command;
pub use episode::{
    EPISODE_STEPS, Episode, EpisodeState, StepOutcome,
    constraints::ConstraintValues,
    env_info::{EnvInfo, env_info, env_info_for},
};
pub use game::{Game, GameSetup, GameState, GameStep, referee::RallyEnd};
// Actions and joint states are in terms of these.
pub use dynamics::path::LanePath;
pub use faceoff_types::{Interpolation, JOINTS, PerturbationSettings, SUBSTEPS};
pub use robot::plant::Plant;
pub use together::{step_together, step_together_by};
pub use world::{Bounds, Divergence, Impact, Impacts, MalletState, Met, Runaway, World};

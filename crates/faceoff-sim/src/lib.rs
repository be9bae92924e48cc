//! The air-hockey simulator: two KUKA arms, a table and a puck, as in the *reference*, the simulator of the 2023 Robot Air Hockey
//! Challenge (MuJoCo). `docs/simulator.md` describes its parts.
//!
//! The arm's dynamics, its 1 kHz torque controller and the soft contacts follow the reference's
//! equations, so that trajectories agree with its recordings; tests check each kind of recording.
//! Everything is deterministic: the same seed gives the same bits in debug and release builds and on
//! any number of threads. Sines and cosines are polynomials of this crate; other transcendental functions come from
//! `libm`, never from the platform.
//!
//! Symbols in the whole crate: `q` are joint positions, `dq` joint velocities, `ddq` joint accelerations (rad, rad/s, rad/s²), and
//! `ee` is the end effector. A *substep* is one step of physics (1 ms), a *control step* one action of an agent (20 substeps).
//!
//! This crate reads no clock and no environment and does no I/O. It does not handle agent processes or
//! scores.

#![expect(
    clippy::needless_range_loop,
    reason = "joints are numbered: one index runs over several arrays, as in the equations"
)]

pub mod batch;
// The link between an agent and its robot: observations and commands, with the perturbations (noise, delays, a lost puck).
pub mod channel;
pub mod dynamics;
pub mod episode;
mod episode_step;
mod fingerprint;
// The robot model in formats of other simulators.
pub mod export;
pub mod game;
pub mod golden;
mod interpolation;
pub mod model;
pub mod perturbation;
pub mod robot;
mod ruleset;
// Random numbers.
pub mod stream;
pub mod table;
pub mod world;

pub use batch::{Batch, BatchOutcome, BatchSetup};
pub use channel::Command;
pub use dynamics::simd_level::SimdLevel;
pub use episode::{
    AirHockeyTask, EPISODE_STEPS, Episode, EpisodeState, StepOutcome,
    constraints::{ConstraintValues, ViolatedConstraints},
    env_info::{EnvInfo, env_info, env_info_for},
};
pub use episode_step::{step_episodes, step_episodes_on};
pub use fingerprint::simulator_fingerprint;
pub use game::{Game, GameSetup, GameState, GameStep, referee::RallyEnd};
pub use interpolation::{Interpolation, JOINTS, MAX_ACTION_LEN, SUBSTEPS, UnknownInterpolation};
pub use perturbation::{
    ActivePerturbations, AirHockeyProfile, DelaySettings, DisturbanceSettings, MismatchSettings,
    NoiseSettings, Perturbation, PerturbationSettings, TrackingLossSettings,
};
pub use robot::plant::Plant;
pub use ruleset::AirHockeyRuleset;
pub use world::{
    Bounds, ContactBody, Divergence, DivergenceCause, Impact, Impacts, MalletState, World,
};

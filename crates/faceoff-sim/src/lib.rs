//! The air-hockey simulator. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_types::{EpisodeEnd, Factors, Seed, Task, Violations};

pub const JOINTS: usize = 7;
pub const SUBSTEPS: usize = 20;
/// Control steps of a qualifying episode.
pub const EPISODE_STEPS: u32 = 500;

/// How actions become a trajectory (PROTOCOL).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation { Linear, Quadratic, Cubic, Quartic, Quintic, LinearBoth, Trajectory }
impl Interpolation {
    /// 1,2,3,4,5,-1,None(null)
    pub fn from_code(code: Option<i64>) -> Option<Self> { unimplemented!() }
    pub fn code(self) -> Option<i64> { unimplemented!() }
    /// e.g. [2, 7] ; [7] ; [20,3,7]
    pub fn shape(self) -> &'static [usize] { unimplemented!() }
    /// product of shape: 7, 14, 21, 420
    pub fn len(self) -> usize { unimplemented!() }
}

/// Magnitudes of the factors; Default = RULES' numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PerturbationSettings { /* sim crate fills in */ }

/// The season's plant (mismatch drawn, or nominal). Made once, shared by all episodes.
#[derive(Debug, Clone)]
pub struct Plant;
impl Plant {
    pub fn nominal() -> Self { unimplemented!() }
    /// seed = the season's model_mismatch seed
    pub fn mismatched(settings: &PerturbationSettings, seed: Seed) -> Self { unimplemented!() }
}

/// One qualifying episode. Deterministic: no clock, no I/O. Clone = exact save/restore of the world.
#[derive(Debug, Clone)]
pub struct Episode;
impl Episode {
    /// `plant` is nominal unless the factors contain ModelMismatch (caller chooses it through `Plant::mismatched`).
    pub fn new(task: Task, interpolation: Interpolation, factors: Factors, settings: &PerturbationSettings, plant: &Plant, seed: Seed) -> Self { unimplemented!() }
    /// The noisy observation the agent gets (23 numbers for hit, 20 otherwise).
    pub fn observation(&self) -> &[f64] { unimplemented!() }
    /// One control step. `action` is row-major, of length interpolation.len(), finite.
    /// Must not be called after an end.
    pub fn step(&mut self, action: &[f64]) -> StepOutcome { unimplemented!() }
    pub fn steps(&self) -> u32 { unimplemented!() }
    /// Success tested on the last true state.
    pub fn success(&self) -> bool { unimplemented!() }
    /// Constraints broken so far.
    pub fn violations(&self) -> Violations { unimplemented!() }
    /// True state after the last step (or initial).
    pub fn state(&self) -> EpisodeState { unimplemented!() }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOutcome {
    pub end: Option<EpisodeEnd>,
    /// Constraint values as the maximum over the group's values at this step; violated when > 0.
    pub constraints: ConstraintValues,
}
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ConstraintValues { pub joint_pos: f64, pub joint_vel: f64, pub ee: f64, pub link: f64 }

/// True state, recorded per step. SI units, table frame for the puck, joint space for robots.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeState {
    /// x, y, yaw, vx, vy, yaw rate
    pub puck: [f64; 6],
    pub q: [f64; 7],
    pub dq: [f64; 7],
    /// low-pass filtered joint velocity
    pub dq_filtered: [f64; 7],
    /// universal joint angles
    pub universal: [f64; 2],
    /// end effector, own robot base frame
    pub ee: [f64; 3],
    /// opponent (robot 2) joints, `hit` only
    pub opponent_q: Option<[f64; 7]>,
    pub opponent_ee: Option<[f64; 3]>,
}

/// `env` of PROTOCOL's hello, as plain data so that wire can serialise it.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvInfo {
    pub n_agents: u32,
    pub table_length: f64, pub table_width: f64, pub goal_width: f64,
    pub puck_radius: f64, pub mallet_radius: f64,
    pub ee_desired_height: f64, pub universal_height: f64, pub control_frequency: f64,
    pub joint_pos_limit: [[f64; 7]; 2], pub joint_vel_limit: [[f64; 7]; 2], pub joint_acc_limit: [[f64; 7]; 2],
    /// 4x4 row-major, table_from_robot, own first
    pub base_frame: Vec<[f64; 16]>,
    pub dt: f64,
}
pub fn env_info(task: Task) -> EnvInfo { unimplemented!() }

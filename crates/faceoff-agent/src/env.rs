//! The field `env` of the evaluator's first message, `hello`: constants of table, puck, mallet and robot.

use serde::Deserialize;

/// Number of driven joints.
pub const JOINTS: usize = 7;

/// The fields of `env` in `hello` that agents use; other fields are ignored. Constants of the nominal robot.
#[derive(Debug, Clone, Deserialize)]
pub struct Env {
    /// Control period in seconds.
    pub dt: f64,
    /// Table dimensions.
    pub table: TableInfo,
    /// Puck dimensions.
    pub puck: RadiusInfo,
    /// Mallet dimensions.
    pub mallet: RadiusInfo,
    /// Robot limits and placement.
    pub robot: RobotInfo,
}

/// Table dimensions in metres.
#[derive(Debug, Clone, Deserialize)]
pub struct TableInfo {
    /// Inner length, along x.
    pub length: f64,
    /// Inner width, along y.
    pub width: f64,
    /// Width of the goal mouth.
    pub goal_width: f64,
}

/// A disc (puck or mallet).
#[derive(Debug, Clone, Deserialize)]
pub struct RadiusInfo {
    /// Radius in metres.
    pub radius: f64,
}

/// Limits and placement of the agent's robot.
#[derive(Debug, Clone, Deserialize)]
pub struct RobotInfo {
    /// Height at which the rules want the end effector (the tip of the arm), in the robot's base frame, metres.
    pub ee_desired_height: f64,
    /// Lower and upper joint position limits, radians; constraints are tested at 95 % of them.
    pub joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper joint velocity limits, radians per second; constraints are tested at 95 % of them.
    pub joint_vel_limit: [[f64; JOINTS]; 2],
    /// Homogeneous transforms from a robot's base frame to the table's frame, one per robot, the agent's own first.
    pub base_frame: Vec<BaseFrame>,
}

impl RobotInfo {
    /// Distance of the agent's base from the table's centre along x, metres; `None` without a base frame.
    #[must_use]
    pub fn base_distance_m(&self) -> Option<f64> {
        self.base_frame.first().map(BaseFrame::distance_m)
    }
}

/// A homogeneous transform (4×4), written as 16 numbers or as four rows.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum BaseFrame {
    /// 16 numbers, row-major.
    Flat([f64; 16]),
    /// Four rows.
    Rows([[f64; 4]; 4]),
}

impl BaseFrame {
    /// Distance of the base from the table's centre along x, metres.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        match self {
            Self::Flat(m) => m[3].abs(),
            Self::Rows(m) => m[0][3].abs(),
        }
    }
}

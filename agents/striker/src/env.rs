//! What the evaluator says about the robot and the table (the `env` of `hello`).

use nalgebra::SVector;
use serde::Deserialize;

/// Number of driven joints.
pub const JOINTS: usize = 7;
/// A value per joint.
pub type Joints = SVector<f64, JOINTS>;

/// The part of the protocol's `env` object that this agent uses; other fields are ignored.
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

/// A disc's radius in metres.
#[derive(Debug, Clone, Deserialize)]
pub struct RadiusInfo {
    /// Radius in metres.
    pub radius: f64,
}

/// Limits and placement of the agent's own arm.
#[derive(Debug, Clone, Deserialize)]
pub struct RobotInfo {
    /// Height of the end effector in the robot's base frame, metres.
    pub ee_desired_height: f64,
    /// Lower and upper joint position limits, radians.
    pub joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper joint velocity limits, radians per second.
    pub joint_vel_limit: [[f64; JOINTS]; 2],
    /// `table_from_robot` as row-major 4×4, one per robot, own first.
    pub base_frame: Vec<BaseFrame>,
}

/// A homogeneous transform: 16 numbers in a row, or four rows of four.
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

/// Share of the joint limits beyond which the evaluator counts a violation.
pub const LIMIT_SHARE: f64 = 0.95;

impl RobotInfo {
    /// Largest allowed joint speeds, radians per second.
    #[must_use]
    pub fn joint_speed_max(&self) -> Joints {
        Joints::from_fn(|i, _| {
            LIMIT_SHARE * self.joint_vel_limit[1][i].min(-self.joint_vel_limit[0][i])
        })
    }

    /// Largest allowed joint angles (the ranges are symmetric), radians.
    #[must_use]
    pub fn joint_angle_max(&self) -> Joints {
        Joints::from_fn(|i, _| {
            LIMIT_SHARE * self.joint_pos_limit[1][i].min(-self.joint_pos_limit[0][i])
        })
    }

    /// Distance of the base from the table's centre along x, metres.
    #[must_use]
    pub fn base_distance_m(&self) -> f64 {
        self.base_frame.first().map_or(1.51, BaseFrame::distance_m)
    }
}

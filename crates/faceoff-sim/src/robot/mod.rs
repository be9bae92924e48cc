//! The robot: its *plant* (physical properties), the trajectories of its joints, its controllers and its inverse kinematics.

pub mod controller;
pub mod inverse_kinematics;
pub mod plant;
pub mod trajectory;
pub mod universal_joint;

//! The robot: its numbers, its controller and its inverse kinematics.

pub mod controller;
pub mod interpolation;
pub mod inverse_kinematics;
pub mod model;
pub mod plant;
pub mod universal_joint;

//! The ideal model as text that other programs read: URDF and MJCF for simulators and libraries of robotics,
//! a Python module of its numbers, and a drawing.
//!
//! All of it is written from the constants that the simulator itself uses. Geometry is made of primitives;
//! where it only shows something (the shape of the arm) it has no part in the physics.

mod drawing;
mod mjcf;
mod numbers;
mod parts;
mod python;
mod urdf;

pub use drawing::drawing;
pub use mjcf::mjcf;
pub use parts::Model;
pub use python::python;
pub use urdf::urdf;

//! Exports of the nominal robot, table and puck: URDF (a robot description in XML) and MJCF (MuJoCo's XML) for other simulators and
//! robotics libraries, a Python module of constants, and a drawing.
//!
//! There are two models of the robot ([`ExportedModel`]): the *plant*, which is simulated, and the *controller*'s, with which the
//! controller of the simulated robot computes its torques.
//!
//! All of it is generated from the constants that the simulator uses. Geometry consists of primitives. The
//! shape of the arm serves display only.

mod drawing;
mod mjcf;
mod numbers;
mod parts;
mod python;
mod urdf;

pub use drawing::drawing;
pub use mjcf::mjcf;
pub use parts::ExportedModel;
pub use python::python;
pub use urdf::urdf;

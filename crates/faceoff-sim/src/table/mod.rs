//! Table, puck and contacts.

pub mod contact_finder;
pub mod contact_law;
pub mod geometry;
pub mod mallet_cylinder;
pub mod puck;

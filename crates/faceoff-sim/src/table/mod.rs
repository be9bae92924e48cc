//! Table, puck and contacts.

pub mod contact_finder;
pub mod contact_law;
pub mod frames;
pub mod geometry;
pub mod mallet_cylinder;
pub mod puck;

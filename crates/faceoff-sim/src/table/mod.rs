//! Table, puck and mallets: geometry, coordinate frames, contacts and the puck's motion.

pub mod contact_finder;
pub mod contact_law;
pub mod frames;
pub mod geometry;
pub mod mallet_cylinder;
pub mod puck;

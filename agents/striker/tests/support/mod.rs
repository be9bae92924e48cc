//! What tests and development tools share.

pub mod env;
pub mod game;

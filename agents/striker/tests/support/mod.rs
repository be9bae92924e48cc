//! Shared code of tests and development tools.

pub mod env;
pub mod game;

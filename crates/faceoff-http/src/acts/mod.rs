//! What API and pages both do, each for its own kind of client.

pub(crate) mod drawing;
pub(crate) mod entering;
pub(crate) mod joining;
pub(crate) mod registering;
pub(crate) mod signing_in;

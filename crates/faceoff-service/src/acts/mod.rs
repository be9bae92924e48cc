//! What API and pages both do, each for its own kind of client.

pub mod bundle_stream;
pub mod deciding;
pub mod drawing;
pub mod entering;
pub mod entering_days;
pub mod inviting;
pub mod joining;
pub mod keys;
pub mod people;
pub mod registering;
pub mod rulings;
pub mod settling;
pub mod signing_in;
pub mod staging;
pub mod teams;
pub mod telling;
pub mod turns;
pub mod uploading;
pub mod workers;

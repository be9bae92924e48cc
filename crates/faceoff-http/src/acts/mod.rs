//! What API and pages both do, each for its own kind of client.

pub(crate) mod bundle_stream;
pub(crate) mod deciding;
pub(crate) mod drawing;
pub(crate) mod entering;
pub(crate) mod entering_days;
pub(crate) mod inviting;
pub(crate) mod joining;
pub(crate) mod keys;
pub(crate) mod people;
pub(crate) mod registering;
pub(crate) mod rulings;
pub(crate) mod settling;
pub(crate) mod signing_in;
pub(crate) mod staging;
pub(crate) mod teams;
pub(crate) mod telling;
pub(crate) mod turns;
pub(crate) mod uploading;
pub(crate) mod workers;

//! The types of the HTTP API: request bodies and queries ([`requests`]), response bodies ([`views`]), the paths of
//! resources and the format of secrets.
//!
//! The server and the command line share them. This crate depends on no web server and no database; `faceoff-service`
//! builds the responses.

#![warn(missing_docs)]

pub mod objects_only;
pub mod paths;
pub mod requests;
pub mod secret_extraction;
pub mod token;
pub mod views;

pub use paths::API_BASE;

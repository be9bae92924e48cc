//! The types of the API: what clients send ([`requests`]) and what they are answered ([`views`]), with where its
//! resources are and what its secrets look like.
//!
//! Server and command line share them. It knows no web server and no database: how an answer is made is
//! `faceoff-service`'s.

#![warn(missing_docs)]

pub mod objects_only;
pub mod paths;
pub mod requests;
pub mod token;
pub mod views;

pub use paths::API_BASE;

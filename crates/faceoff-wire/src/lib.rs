//! The formats that Faceoff shares with other programs: the agent protocol, the bundle's `agent.toml`, the files of a
//! dataset, and the jobs of workers, which may be on other machines.
//!
//! All formats are versioned and limited in size. The crate does no I/O, reads no clock and starts no process: it
//! works on byte slices. Answers of agents are parsed once, into types. An invalid answer becomes an
//! [`AgentFaultKind`](faceoff_types::AgentFaultKind) that says what was expected and what was sent.
//!
//! * [`message`]: messages of the evaluator (`hello`, `reset`, `step`, `end`, `bye`);
//! * [`answer`]: answers of the agent (`ready`, `act`);
//! * [`Manifest`][]: `agent.toml`;
//! * [`dataset`]: the JSON files of a recorded evaluation;
//! * [`game`]: the specification of a game, and the JSON files of its recording;
//! * [`job`]: jobs of workers and the reports on them;
//! * [`remote`]: messages between the server and remote workers;
//! * [`grant`]: the file access of remote workers.

#![warn(missing_docs)]

pub mod answer;
pub mod dataset;
pub mod game;
pub mod grant;
pub mod job;
mod manifest;
pub mod message;
mod protocol;
mod quote;
pub mod remote;

pub use manifest::{MANIFEST_MAX_BYTES, Manifest, ManifestError, StandardOutput};
pub use message::Message;
pub use protocol::{MAX_LINE_BYTES, PROTOCOL_VERSION};
pub use quote::quote_line;

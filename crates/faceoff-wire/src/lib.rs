//! What Faceoff promises to outsiders: the agent protocol, the bundle's `agent.toml`, the files of a
//! dataset and the work orders of slots, which may be on other machines.
//!
//! Everything here is versioned, size-capped and free of I/O: bytes come in and go out as slices,
//! and the crate neither reads a clock nor knows a process. What an agent says is parsed once, into
//! types; whatever does not fit becomes an [`AgentFaultKind`](faceoff_types::AgentFaultKind) that
//! says what was expected and what came.
//!
//! * [`message`]: what the evaluator says (`hello`, `reset`, `step`, `end`, `bye`);
//! * [`answer`]: what the agent answers (`ready`, `act`);
//! * [`Manifest`][]: `agent.toml`;
//! * [`dataset`]: `manifest.json` and `violations.json` of a recorded evaluation;
//! * [`game`]: what a slot is told to play as a game, and `manifest.json` of its recording;
//! * [`work`]: what a worker slot is told to do and reports back;
//! * [`remote`]: what passes between the server and workers on other machines, and [`grant`]: what they may read and write.

#![warn(missing_docs)]

pub mod answer;
pub mod dataset;
pub mod game;
pub mod grant;
mod manifest;
pub mod message;
mod protocol;
mod quote;
pub mod remote;
pub mod work;

pub use manifest::{MANIFEST_MAX_BYTES, Manifest, ManifestError};
pub use message::{Env, Message, ProtocolTask};
pub use protocol::{MAX_LINE_BYTES, PROTOCOL_VERSION};
pub use quote::quote_line;

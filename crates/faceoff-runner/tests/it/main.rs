//! The runner as the platform uses it: real archives, real agent processes in the sandbox, real
//! recordings.

mod agents;
mod archives;
mod bundle;
mod dataset;
mod misbehaviour;
mod recording;
mod shard;

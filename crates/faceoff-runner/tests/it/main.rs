//! The runner as the platform uses it: real archives, real agent processes, real recordings.

mod archives;
mod bundle;

//! Version and size limit of the agent protocol: JSON lines between the evaluator and an agent.

/// Version of the agent protocol, the `protocol` of `hello` and `ready`.
pub const PROTOCOL_VERSION: u32 = 1;

/// Longest line in either direction, in bytes, without the newline.
pub const MAX_LINE_BYTES: usize = 64 * 1024;

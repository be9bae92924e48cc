//! Which program this is, and which had a database open.

/// A version of the program, and the newest migration that it knew.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// As in `faceoff --version`.
    pub version: String,
    /// Number of its newest migration.
    pub schema: i64,
}

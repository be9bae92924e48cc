//! [`Program`]: the version of Faceoff that opens a database.

/// A version of Faceoff, with the newest migration that it knows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// As in `faceoff --version`.
    pub version: String,
    /// Number of its newest migration.
    pub schema: i64,
}

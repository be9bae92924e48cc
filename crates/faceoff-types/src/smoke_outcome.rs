use serde::{Deserialize, Serialize};

/// What a smoke run found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum SmokeOutcome {
    /// The agent starts, answers and keeps time.
    Valid {
        /// The name in its manifest.
        agent_name: String,
        /// Tail of its standard error.
        log: String,
    },
    /// The team's fault.
    Invalid {
        /// The name in its manifest, if that could be read.
        agent_name: Option<String>,
        /// What is wrong and where.
        reason: String,
        /// Tail of its standard error.
        log: String,
    },
}

//! Wire. (contract stub)
#![expect(missing_docs, reason = "contract stub")]
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
/// agent.toml
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    pub name: String, pub command: Vec<String>, pub runtime: String,
    /// outer None = not stated
    pub interpolation: Option<i64>,
    #[serde(default)] pub env: BTreeMap<String, String>,
}

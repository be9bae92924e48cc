//! Violations of the safety constraints in an evaluation, episode by episode: the contents of the dataset's
//! `violations.json`.

use faceoff_types::Task;
use faceoff_wire::dataset::TaskViolations;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Violations of an evaluation whose day is released (made public), by task and constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViolationsView {
    /// By task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskViolations>,
}

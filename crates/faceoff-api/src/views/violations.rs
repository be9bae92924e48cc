//! Violations of the safety constraints in an evaluation, episode by episode: the contents of the dataset's
//! `violations.json`.

use faceoff_types::Task;
use faceoff_wire::dataset::TaskViolations;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Violations of an evaluation whose day is released (made public), by task and constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViolationsView {
    /// By task.
    pub tasks: IndexMap<Task, TaskViolations>,
}

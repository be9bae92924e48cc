//! Where an evaluation cost points, episode by episode: what its dataset says in `violations.json`.

use crate::{app::AppState, problem::Problem};
use faceoff_dataset::Dataset;
use faceoff_types::Task;
use faceoff_wire::dataset::TaskViolations;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// The violations of an evaluation whose day is released, by task and constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViolationsView {
    /// By task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskViolations>,
}

impl ViolationsView {
    /// Reads them out of a finished evaluation's dataset, an artifact. Whether its day is released is the caller's
    /// to check.
    ///
    /// # Errors
    /// An internal problem if the dataset cannot be read: what a finished evaluation names must be there.
    pub(crate) async fn read(app: &AppState, dataset: &str) -> Result<Self, Problem> {
        let path = app
            .store
            .artifacts()
            .path_of(dataset)
            .map_err(Problem::internal)?;
        let read = move || Dataset::open_unread(&path)?.violations();
        let file = tokio::task::spawn_blocking(read)
            .await
            .map_err(Problem::internal)?
            .map_err(|error| Problem::internal(format_args!("{dataset}: {error}")))?;
        Ok(Self { tasks: file.tasks })
    }
}

//! Violations of an evaluation: for each task and constraint, the episodes in which the robot violated it. A *constraint* is a limit
//! of the robot's motion, such as the largest joint velocity. The data is the file `violations.json` of the dataset.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_api::views::violations::ViolationsView;
use faceoff_dataset::Dataset;
use std::sync::Arc;

/// Reads the violations from a finished evaluation's dataset, given its artifact key. The caller checks that the day is
/// released.
///
/// # Errors
/// `Internal` if the dataset cannot be read: a finished evaluation must have one.
#[boxed_future]
pub async fn read(app: &AppState, dataset: &str) -> Result<ViolationsView, Problem> {
    let path = app
        .store
        .artifacts()
        .local_path(dataset)
        .map_err(Problem::internal)?;
    let competition = Arc::clone(app.config.competition());
    let read = move || Dataset::open_lazily(&path, &competition)?.violations();
    let violations = tokio::task::spawn_blocking(read)
        .await
        .map_err(Problem::internal)?
        .map_err(|error| Problem::internal(format_args!("{dataset}: {error}")))?;
    Ok(ViolationsView {
        tasks: violations.tasks,
    })
}

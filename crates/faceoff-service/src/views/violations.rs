//! Violations of an evaluation, episode by episode, from the dataset's `violations.json`.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::violations::ViolationsView;
use faceoff_dataset::Dataset;

/// Reads the violations from a finished evaluation's dataset, given its artifact key. The caller checks that the day is
/// released.
///
/// # Errors
/// `Internal` if the dataset cannot be read: a finished evaluation must have one.
#[boxed]
pub async fn read(app: &AppState, dataset: &str) -> Result<ViolationsView, Problem> {
    let path = app
        .store
        .artifacts()
        .local_path(dataset)
        .map_err(Problem::internal)?;
    let read = move || Dataset::open_lazily(&path)?.violations();
    let file = tokio::task::spawn_blocking(read)
        .await
        .map_err(Problem::internal)?
        .map_err(|error| Problem::internal(format_args!("{dataset}: {error}")))?;
    Ok(ViolationsView { tasks: file.tasks })
}

//! Where an evaluation cost points, episode by episode: what its dataset says in `violations.json`.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::violations::ViolationsView;
use faceoff_dataset::Dataset;

/// Reads them out of a finished evaluation's dataset, an artifact. Whether its day is released is the caller's
/// to check.
///
/// # Errors
/// An internal problem if the dataset cannot be read: what a finished evaluation names must be there.
#[boxed]
pub async fn read(app: &AppState, dataset: &str) -> Result<ViolationsView, Problem> {
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
    Ok(ViolationsView { tasks: file.tasks })
}

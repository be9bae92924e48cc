//! How strong a tournament's submissions are, from their games.

use crate::{
    app::App,
    boxed,
    problem::{Problem, ProblemKind},
    views::tournament_sheet::TournamentSheet,
};
use faceoff_scoring::tournament::{
    HeadToHead, head_to_head,
    rating::{RatingError, Ratings, rate},
};
use faceoff_types::TournamentId;
use std::sync::Arc;

/// As they were worked out since the newest change of the season; the same numbers for everybody. In a task of its own,
/// so that who asks and goes does not have them worked out for nobody.
#[boxed]
pub async fn ratings(app: &App, id: TournamentId) -> Result<Arc<Ratings>, Problem> {
    let app = Arc::clone(app);
    let task = tokio::spawn(async move {
        let make = async || make(&app, id).await;
        app.ratings.get(&app.store, id, make).await
    });
    task.await.map_err(Problem::internal)?
}

async fn make(app: &App, id: TournamentId) -> Result<Ratings, Problem> {
    let sheet = TournamentSheet::find(app, id).await?;
    // A thousand fits for the intervals.
    let rated =
        tokio::task::spawn_blocking(move || rate(sheet.departures.counting(sheet.played())));
    match rated.await.map_err(Problem::internal)? {
        Err(error @ RatingError::TooMany(_)) => {
            Err(Problem::new(ProblemKind::Conflict, error.to_string()))
        }
        rated => rated.map_err(Problem::internal),
    }
}

/// The record of each two teams that met, by name.
#[boxed]
pub async fn records(app: &App, id: TournamentId) -> Result<Vec<HeadToHead>, Problem> {
    let sheet = TournamentSheet::find(app, id).await?;
    Ok(head_to_head(sheet.departures.counting(sheet.played())))
}

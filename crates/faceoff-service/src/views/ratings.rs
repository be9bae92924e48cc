//! Ratings of a tournament's submissions, from their games.

use crate::{
    app::App,
    boxed,
    problem::{Problem, ProblemKind},
    views::tournament_state::TournamentState,
};
use faceoff_scoring::tournament::{
    HeadToHead, head_to_head,
    rating::{RatingError, Ratings, rate},
};
use faceoff_types::TournamentId;
use std::sync::Arc;

/// The ratings, cached until the season changes. They are computed in a separate task, so that the result is cached even
/// if the client disconnects.
#[boxed]
pub async fn ratings(app: &App, id: TournamentId) -> Result<Arc<Ratings>, Problem> {
    let app = Arc::clone(app);
    let task = tokio::spawn(async move {
        let compute_ratings = async || compute(&app, id).await;
        app.rating_cache.get(&app.store, id, compute_ratings).await
    });
    task.await.map_err(Problem::internal)?
}

async fn compute(app: &App, id: TournamentId) -> Result<Ratings, Problem> {
    let state = TournamentState::find(app, id).await?;
    // The intervals need a thousand fits.
    let rated =
        tokio::task::spawn_blocking(move || rate(state.departures.counting(state.played())));
    match rated.await.map_err(Problem::internal)? {
        Err(error @ RatingError::TooMany(_)) => {
            Err(Problem::new(ProblemKind::Conflict, error.to_string()))
        }
        rated => rated.map_err(Problem::internal),
    }
}

/// The head-to-head record of each pair of teams that met, by name.
#[boxed]
pub async fn records(app: &App, id: TournamentId) -> Result<Vec<HeadToHead>, Problem> {
    let state = TournamentState::find(app, id).await?;
    Ok(head_to_head(state.departures.counting(state.played())))
}

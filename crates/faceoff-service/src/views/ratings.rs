//! Ratings of a tournament's submissions: estimates of playing strength from the results of their games.

use crate::{
    app::App,
    boxed_future,
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
#[boxed_future]
pub async fn ratings(app: &App, id: TournamentId) -> Result<Arc<Ratings>, Problem> {
    let app = Arc::clone(app);
    let task = tokio::spawn(async move {
        let compute = compute_ratings(&app, id);
        app.tournament_answer(&app.ratings, id, compute).await
    });
    task.await.map_err(Problem::internal)?
}

async fn compute_ratings(app: &App, id: TournamentId) -> Result<Ratings, Problem> {
    let state = TournamentState::find(app, id).await?;
    // The uncertainty intervals need a thousand fits of the rating model, so they are computed on a blocking thread.
    let result =
        tokio::task::spawn_blocking(move || rate(state.departures.counting_games(state.played())));
    match result.await.map_err(Problem::internal)? {
        Err(error @ RatingError::TooMany(_)) => {
            Err(Problem::new(ProblemKind::Conflict, error.to_string()))
        }
        ratings => ratings.map_err(Problem::internal),
    }
}

/// The head-to-head record of each pair of teams that met, by name.
#[boxed_future]
pub async fn head_to_head_records(app: &App, id: TournamentId) -> Result<Vec<HeadToHead>, Problem> {
    let state = TournamentState::find(app, id).await?;
    Ok(head_to_head(
        state.departures.counting_games(state.played()),
    ))
}

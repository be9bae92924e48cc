//! Games of two submissions in a tournament: listing, cancelling, voiding and rerunning them. A *schedule replay* is one of the
//! games that repeat the tournament's schedule with other seeds; it does not count.

use crate::paging::{ListQuery, Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Decision, GamesQuery},
    views::{attempt::GameAttemptView, game::GameView},
};
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    services::games,
    viewer::Viewer,
    views::{attempt, game, tournament_state::TournamentState},
};
use faceoff_store::{GamePurpose, GameState};
use faceoff_types::{GameId, TournamentId};

/// Lists the games of a tournament's rounds in the order in which they are played, with results.
#[utoipa::path(
    get, path = "/tournaments/{id}/games", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("id" = TournamentId, Path), GamesQuery, PageQuery),
    responses((status = 200, body = Vec<GameView>), (status = 404))
)]
pub(crate) async fn list_games(
    viewer: Viewer,
    page: Page<GameId>,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    ListQuery(query): ListQuery<GamesQuery>,
) -> Result<Paged<GameView>, Problem> {
    let state = TournamentState::find(&app, id).await?;
    let games = game::round_games(&state, viewer, query.round)?;
    page.select(games, |game| game.id)
}

/// Returns a game. Test and friendly games are visible only to their two teams and organisers.
#[utoipa::path(
    get, path = "/games/{id}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path)),
    responses((status = 200, body = GameView), (status = 404))
)]
pub(crate) async fn game(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<GameView>, Problem> {
    game::find(&app, viewer, id).await.map(Json)
}

/// Cancels a test or friendly game that has not ended. For the team that requested it, and organisers.
#[utoipa::path(
    delete, path = "/games/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path)),
    responses(
        (status = 200, body = GameView),
        (status = 403), (status = 404),
        (status = 409, description = "the game counts, has ended, or, for a team, is running"),
    )
)]
pub(crate) async fn cancel_game(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<GameView>, Problem> {
    let viewer = Viewer::new(&caller);
    let (state, game) = game::find_visible(&app, viewer, id).await?;
    let requested_by = match game.purpose {
        GamePurpose::Test { asked_by } => asked_by,
        GamePurpose::Friendly { asked_by } => Some(asked_by),
        GamePurpose::Round(_) | GamePurpose::ScheduleReplay { .. } => {
            return Err(Problem::new(
                ProblemKind::Conflict,
                "a game of the schedule cannot be cancelled; an organiser can pause the tournament, withdraw a team, or cancel \
                 all replays (DELETE /api/v1/tournaments/ID/replays)",
            ));
        }
    };
    let reason = match caller.team() {
        None => "by an organiser".to_owned(),
        Some(team) if requested_by == Some(team.id) => {
            format!("by {}, which had requested it", team.name)
        }
        Some(_) => {
            return Err(Problem::new(
                ProblemKind::Forbidden,
                "only the team that requested the game can cancel it, or an organiser; a team that wants no friendly games \
                 sets “declines_friendly_games” (PATCH /api/v1/teams/ID)",
            ));
        }
    };
    if caller.team().is_some() && matches!(game.state, GameState::Running { .. }) {
        return Err(Problem::new(
            ProblemKind::Conflict,
            "the game is running, and the other team is entitled to its result; wait until it ends",
        ));
    }
    let now = app.config.clock.now();
    let cancelled = app
        .store
        .cancel_game(caller.actor(), id, &reason, now)
        .await?;
    tracing::info!(game = %id, actor = %caller.actor(), "game cancelled");
    game::view(&state, viewer, &cancelled).map(Json)
}

/// Lists all attempts at a game in chronological order, with their outcomes.
#[utoipa::path(
    get, path = "/games/{id}/attempts", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)),
    responses((status = 200, body = Vec<GameAttemptView>), (status = 404))
)]
pub(crate) async fn list_attempts(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<Vec<GameAttemptView>>, Problem> {
    game::find_visible(&app, Viewer::Organiser, id).await?;
    let attempts = app.store.game_attempts(id).await?;
    Ok(Json(attempts.into_iter().map(attempt::view).collect()))
}

/// Voids the result of a round's game. The next round waits until the game is rerun; the attempt stays in the list.
#[utoipa::path(
    post, path = "/games/{id}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)), request_body = Decision,
    responses(
        (status = 200, body = GameView),
        (status = 404),
        (status = 409, description = "not confirmed with “HOME - AWAY”, the teams' names (nothing is done), not a game of a round, no result, or the tournament is closed"),
        (status = 422),
    )
)]
pub(crate) async fn void_game(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    Body(decision): Body<Decision>,
) -> Result<Json<GameView>, Problem> {
    games::void_game(&app, organiser.actor(), id, &decision).await?;
    game::find(&app, Viewer::Organiser, id).await.map(Json)
}

/// Reruns a game that was voided or failed by a platform fault, with the same submissions and the same seed.
#[utoipa::path(
    post, path = "/games/{id}/rerun", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)),
    responses(
        (status = 200, body = GameView),
        (status = 404),
        (status = 409, description = "the game is neither void nor failed, a team has left, or the tournament or the season is closed"),
    )
)]
pub(crate) async fn rerun_game(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<GameView>, Problem> {
    games::rerun_game(&app, organiser.actor(), id).await?;
    game::find(&app, Viewer::Organiser, id).await.map(Json)
}

//! Games: listed, read, called off, voided and played again.

use crate::paging::{BesidePage, Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Decision, GamesQuery},
    views::{attempt::AttemptView, game::GameView},
};
use faceoff_service::{
    acts::deciding::checked_reason,
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{attempt, game, tournament_sheet::TournamentSheet},
};
use faceoff_store::{GamePurpose, GameState};
use faceoff_types::{GameId, TournamentId};

/// The games of a tournament's rounds, in the order of play, each with what it came to and why.
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
    BesidePage(query): BesidePage<GamesQuery>,
) -> Result<Paged<GameView>, Problem> {
    let sheet = TournamentSheet::find(&app, id).await?;
    let games = game::of_rounds(&sheet, viewer, query.round)?;
    page.cut(games, |game| game.id)
}

/// One game. What does not count is seen by its two teams and organisers alone.
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

/// Calls off a game that does not count and is not over: by the team that asked for it, or an organiser.
#[utoipa::path(
    delete, path = "/games/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path)),
    responses(
        (status = 200, body = GameView),
        (status = 403), (status = 404),
        (status = 409, description = "it counts, is over, or, for a team, is under way"),
    )
)]
pub(crate) async fn cancel_game(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<GameView>, Problem> {
    let viewer = Viewer::of(&caller);
    let (sheet, game) = game::known(&app, viewer, id).await?;
    let asked_by = match game.purpose {
        GamePurpose::Test { asked_by } => asked_by,
        GamePurpose::Friendly { asked_by } => Some(asked_by),
        GamePurpose::Round(_) | GamePurpose::Replay { .. } => {
            return Err(Problem::new(
                ProblemKind::Conflict,
                "a game of the schedule is not called off; an organiser pauses the tournament, withdraws a team, or calls \
                 all replays off (DELETE /api/v1/tournaments/ID/replays)",
            ));
        }
    };
    let reason = match caller.team() {
        None => "by an organiser".to_owned(),
        Some(team) if asked_by == Some(team.id) => {
            format!("by {}, which had asked for it", team.name)
        }
        Some(_) => {
            return Err(Problem::new(
                ProblemKind::Forbidden,
                "who asked for the game calls it off: the other team or an organiser; a team that wants no friendly games \
                 sets “declines_friendly_games” (PATCH /api/v1/teams/ID)",
            ));
        }
    };
    if caller.team().is_some() && matches!(game.state, GameState::Running { .. }) {
        return Err(Problem::new(
            ProblemKind::Conflict,
            "the game is under way, and the other side is to have what it is about: wait for its end",
        ));
    }
    let now = app.config.clock.now();
    let cancelled = app
        .store
        .cancel_game(caller.actor(), id, &reason, now)
        .await?;
    tracing::info!(game = %id, actor = %caller.actor(), "game called off");
    game::of(&sheet, viewer, &cancelled).map(Json)
}

/// Every time that a slot began the game, in order, whatever came of it.
#[utoipa::path(
    get, path = "/games/{id}/attempts", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)),
    responses((status = 200, body = Vec<AttemptView>), (status = 404))
)]
pub(crate) async fn list_attempts(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<Vec<AttemptView>>, Problem> {
    game::known(&app, Viewer::Organiser, id).await?;
    let attempts = app.store.game_attempts(id).await?;
    Ok(Json(attempts.into_iter().map(attempt::of).collect()))
}

/// Has the result of a round's game count no more; its attempt stays. The next round waits until it is played again.
#[utoipa::path(
    post, path = "/games/{id}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)), request_body = Decision,
    responses(
        (status = 200, body = GameView),
        (status = 404),
        (status = 409, description = "not confirmed with “HOME - AWAY”, the teams' names (nothing is done), no game of a round, without a result, or of a closed tournament"),
        (status = 422),
    )
)]
pub(crate) async fn void_game(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    Body(decision): Body<Decision>,
) -> Result<Json<GameView>, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let (sheet, game) = game::known(&app, Viewer::Organiser, id).await?;
    let [home, away] = game.teams;
    let name = format!("{} - {}", sheet.name(home)?, sheet.name(away)?);
    let what = format!(
        "the result of {name} would count no more, at once, with the reason {reason:?} for everybody to read; the next \
         round would wait until it is played again (rerun), on the same seed with the same submissions"
    );
    Problem::check_confirmed(decision.confirm.as_deref(), &name, &what)?;
    let now = app.config.clock.now();
    let voided = app
        .store
        .void_game(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(game = %id, reason, "game voided");
    game::of(&sheet, Viewer::Organiser, &voided).map(Json)
}

/// Plays a game again that was voided, or that we broke: the same submissions on the same seed.
#[utoipa::path(
    post, path = "/games/{id}/rerun", tag = "organiser", security(("organiser" = [])),
    params(("id" = GameId, Path)),
    responses(
        (status = 200, body = GameView),
        (status = 404),
        (status = 409, description = "it is neither void nor broken, a side has left, or the tournament or the season is closed"),
    )
)]
pub(crate) async fn rerun_game(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Json<GameView>, Problem> {
    let (sheet, _) = game::known(&app, Viewer::Organiser, id).await?;
    let now = app.config.clock.now();
    let queued = app.store.rerun_game(organiser.actor(), id, now).await?;
    tracing::info!(game = %id, "game queued again");
    game::of(&sheet, Viewer::Organiser, &queued).map(Json)
}

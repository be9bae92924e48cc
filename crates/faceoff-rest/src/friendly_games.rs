//! Test games against the organisers' baseline (a submission that serves as opponent), and friendly games between two teams.
//! They are played before and between the rounds of a tournament, and do not count.

use crate::paging::{Page, PageQuery, Paged};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{
    paths,
    requests::{NewFriendlyGame, NewTestGames},
    views::game::{GameView, SkippedTestGame, TestGamesView},
};
use faceoff_service::{
    app::App,
    auth::{Caller, TeamCaller},
    extract::{Json as Body, OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    services::entrants,
    viewer::Viewer,
    views::{game, tournament_state::TournamentState},
};
use faceoff_store::{Game, StoreError};
use faceoff_types::{GameId, TeamId, TournamentId};

/// Queues test games of active submissions against the baseline. A team can request them for its own submission, within its
/// daily quota; organisers for any entrants, without a quota.
#[utoipa::path(
    post, operation_id = "order_test_games", path = "/tournaments/{id}/test-games", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = TournamentId, Path)),
    request_body(content = Option<NewTestGames>, content_type = "application/json"),
    responses(
        (status = 201, body = TestGamesView),
        (status = 404),
        (status = 409, description = "a round is running, there is no baseline, the team has no valid active submission or has not entered, or the tournament is closed"),
        (status = 422),
        (status = 429, description = "the team's daily game quota is used up"),
    )
)]
pub(crate) async fn request_test_games(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    OptionalJson(request): OptionalJson<NewTestGames>,
) -> Result<(StatusCode, Json<TestGamesView>), Problem> {
    let state = TournamentState::without_standings(&app, id).await?;
    let requested_by = caller.team().map(|team| team.id);
    let baseline = baseline_team(&app, &state).await?;
    let teams = match (requested_by, request.teams) {
        (None, None) => {
            let entrants = state.entrants.iter();
            let teams = entrants
                .filter(|entrant| entrant.departure.is_none() && Some(entrant.team) != baseline);
            teams.map(|entrant| entrant.team).collect()
        }
        (None, Some(names)) => entrants::find_by_names(&app, "teams", &names).await?,
        (Some(own_team), None) => vec![own_team],
        (Some(own_team), Some(names)) => {
            let teams = entrants::find_by_names(&app, "teams", &names).await?;
            if teams != [own_team] {
                return Err(Problem::new(
                    ProblemKind::Forbidden,
                    "teams: a team can request test games only for itself; leave it out",
                ));
            }
            teams
        }
    };
    if let Some(team) = teams.iter().find(|team| Some(**team) == baseline) {
        let detail = format!(
            "{}: the baseline is a submission of this team, and a team cannot play against itself",
            state.name(*team)?
        );
        return Err(Problem::new(ProblemKind::Conflict, detail));
    }
    let now = app.config.clock.now();
    let (mut queued, mut skipped) = (Vec::new(), Vec::new());
    for team in teams {
        let game = app
            .store
            .request_test_game(caller.actor(), id, team, requested_by, now);
        match game.await {
            Ok(game) => queued.push(game::view(&state, Viewer::new(&caller), &game)?),
            // If an organiser asks for several teams, one that cannot play does not affect the others.
            Err(
                error @ (StoreError::Conflict(_)
                | StoreError::Disqualified { .. }
                | StoreError::TeamRetired { .. }
                | StoreError::TermsNotAccepted { .. }),
            ) if requested_by.is_none() => {
                let reason = error.to_string();
                let team_name = state.name(team)?;
                skipped.push(SkippedTestGame {
                    team,
                    team_name,
                    reason,
                });
            }
            Err(error) => return Err(Problem::with_quota_reset(error, now)),
        }
    }
    if let (true, Some(first)) = (queued.is_empty(), skipped.first()) {
        let detail = format!("no game was queued. {}: {}", first.team_name, first.reason);
        return Err(Problem::new(ProblemKind::Conflict, detail));
    }
    tracing::info!(tournament = %id, actor = %caller.actor(), games = queued.len(), "test games queued");
    let view = TestGamesView { queued, skipped };
    Ok((StatusCode::CREATED, Json(view)))
}

/// The team whose submission is the tournament's baseline.
async fn baseline_team(app: &App, state: &TournamentState) -> Result<Option<TeamId>, Problem> {
    Ok(match state.tournament.baseline {
        Some(submission) => Some(app.store.submission(submission).await?.team),
        None => None,
    })
}

/// Queues a friendly game of the calling team's active submission, which plays on the home side, against another team's.
#[utoipa::path(
    post, operation_id = "order_friendly_game", path = "/tournaments/{id}/friendly-games", tag = "team", security(("team" = [])),
    params(("id" = TournamentId, Path)), request_body = NewFriendlyGame,
    responses(
        (status = 201, body = GameView, headers(("Location" = String, description = "path of the game"))),
        (status = 404),
        (status = 409, description = "a round is running, the opponent declines friendly games, one of the teams has no valid active submission or has not entered, or the tournament is closed"),
        (status = 422),
        (status = 429, description = "the team's daily game quota is used up"),
    )
)]
pub(crate) async fn request_friendly_game(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(NewFriendlyGame { opponent }): Body<NewFriendlyGame>,
) -> Result<impl IntoResponse, Problem> {
    let state = TournamentState::without_standings(&app, id).await?;
    let opponent = entrants::find_by_names(&app, "opponent", &[opponent]).await?[0];
    let own_team = caller.team.id;
    if opponent == own_team {
        return Err(Problem::invalid(
            "opponent",
            "expected another team, got your own; name an opponent",
        ));
    }
    let now = app.config.clock.now();
    let game: Game = app
        .store
        .request_friendly_game(caller.actor(), id, own_team, opponent, now)
        .await
        .map_err(|error| Problem::with_quota_reset(error, now))?;
    tracing::info!(tournament = %id, game = %game.id, team = %caller.team.name, "friendly game queued");
    let view = game::view(&state, Viewer::Team(own_team), &game)?;
    let location = [(header::LOCATION, paths::game(game.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

/// Lists test and friendly games, newest first: for a team its own, for organisers all.
#[utoipa::path(
    get, path = "/tournaments/{id}/uncounted-games", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = TournamentId, Path), PageQuery),
    responses((status = 200, body = Vec<GameView>), (status = 404))
)]
pub(crate) async fn list_uncounted_games(
    caller: Caller,
    page: Page<GameId>,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Paged<GameView>, Problem> {
    let games = game::test_and_friendly_games(&app, Viewer::new(&caller), id).await?;
    page.select(games, |game| game.id)
}

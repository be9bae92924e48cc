//! Games that do not count, before and between rounds: against the organisers' baseline, and between two teams.

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
    views::game::{GameView, NotOrdered, TestGamesView},
};
use faceoff_service::{
    acts::entering,
    app::App,
    auth::{Caller, TeamCaller},
    extract::{Json as Body, OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, tournament_sheet::TournamentSheet},
};
use faceoff_store::{Game, StoreError};
use faceoff_types::{GameId, TeamId, TournamentId};

/// Plays what teams have active against the baseline: a team its own, within its quota of the day; an organiser anybody's
/// who is in the tournament, without one.
#[utoipa::path(
    post, path = "/tournaments/{id}/test-games", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = TournamentId, Path)),
    request_body(content = Option<NewTestGames>, content_type = "application/json"),
    responses(
        (status = 201, body = TestGamesView),
        (status = 404),
        (status = 409, description = "a round is under way, there is no baseline, nothing valid is active, or not in the tournament, or that is closed"),
        (status = 422),
        (status = 429, description = "the team has asked for as many games today as it may"),
    )
)]
pub(crate) async fn order_test_games(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    OptionalJson(wanted): OptionalJson<NewTestGames>,
) -> Result<(StatusCode, Json<TestGamesView>), Problem> {
    let sheet = TournamentSheet::unscored(&app, id).await?;
    let asked_by = caller.team().map(|team| team.id);
    let baselines = baselines_team(&app, &sheet).await?;
    let teams = match (asked_by, wanted.teams) {
        (None, None) => {
            let entrants = sheet.entrants.iter();
            let tested = entrants.filter(|one| one.left.is_none() && Some(one.team) != baselines);
            tested.map(|entrant| entrant.team).collect()
        }
        (None, Some(names)) => entering::named(&app, "teams", &names).await?,
        (Some(own), None) => vec![own],
        (Some(own), Some(names)) => {
            let teams = entering::named(&app, "teams", &names).await?;
            if teams != [own] {
                return Err(Problem::new(
                    ProblemKind::Forbidden,
                    "teams: a team has its own agent tested alone; leave it out",
                ));
            }
            teams
        }
    };
    if let Some(own) = teams.iter().find(|team| Some(**team) == baselines) {
        let detail = format!(
            "{}: the baseline is its own, and a team cannot play itself",
            sheet.name(*own)?
        );
        return Err(Problem::new(ProblemKind::Conflict, detail));
    }
    let now = app.config.clock.now();
    let (mut ordered, mut not_ordered) = (Vec::new(), Vec::new());
    for team in teams {
        let game = app
            .store
            .order_test_game(caller.actor(), id, team, asked_by, now);
        match game.await {
            Ok(game) => ordered.push(game::of(&sheet, Viewer::of(&caller), &game)?),
            // What keeps one team from it keeps no other from it.
            Err(
                error @ (StoreError::Conflict(_)
                | StoreError::Disqualified { .. }
                | StoreError::Retired { .. }
                | StoreError::TermsOwed { .. }),
            ) if asked_by.is_none() => {
                let reason = error.to_string();
                let team_name = sheet.name(team)?;
                not_ordered.push(NotOrdered {
                    team,
                    team_name,
                    reason,
                });
            }
            Err(error) => return Err(Problem::of_day(error, now)),
        }
    }
    if let (true, Some(first)) = (ordered.is_empty(), not_ordered.first()) {
        let detail = format!("no game was queued. {}: {}", first.team_name, first.reason);
        return Err(Problem::new(ProblemKind::Conflict, detail));
    }
    tracing::info!(tournament = %id, actor = %caller.actor(), games = ordered.len(), "test games ordered");
    let view = TestGamesView {
        ordered,
        not_ordered,
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// Whose the baseline is.
async fn baselines_team(app: &App, sheet: &TournamentSheet) -> Result<Option<TeamId>, Problem> {
    Ok(match sheet.tournament.baseline {
        Some(submission) => Some(app.store.submission(submission).await?.team),
        None => None,
    })
}

/// Plays what the caller's team has active, at home, against what another team has.
#[utoipa::path(
    post, path = "/tournaments/{id}/friendly-games", tag = "team", security(("team" = [])),
    params(("id" = TournamentId, Path)), request_body = NewFriendlyGame,
    responses(
        (status = 201, body = GameView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 404),
        (status = 409, description = "a round is under way, the opponent declines such games, one of them has nothing valid active or is not in the tournament, or that is closed"),
        (status = 422),
        (status = 429, description = "the team has asked for as many games today as it may"),
    )
)]
pub(crate) async fn order_friendly_game(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(NewFriendlyGame { opponent }): Body<NewFriendlyGame>,
) -> Result<impl IntoResponse, Problem> {
    let sheet = TournamentSheet::unscored(&app, id).await?;
    let opponent = entering::named(&app, "opponent", &[opponent]).await?[0];
    let own = caller.team.id;
    if opponent == own {
        return Err(Problem::invalid(
            "opponent",
            "a team does not play against itself; name another one",
        ));
    }
    let now = app.config.clock.now();
    let game: Game = app
        .store
        .order_friendly_game(caller.actor(), id, own, opponent, now)
        .await
        .map_err(|error| Problem::of_day(error, now))?;
    tracing::info!(tournament = %id, game = %game.id, team = %caller.team.name, "friendly game ordered");
    let view = game::of(&sheet, Viewer::Team(own), &game)?;
    let location = [(header::LOCATION, paths::game(game.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

/// The games that do not count: a team's own, an organiser all, the newest first.
#[utoipa::path(
    get, path = "/tournaments/{id}/free-games", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = TournamentId, Path), PageQuery),
    responses((status = 200, body = Vec<GameView>), (status = 404))
)]
pub(crate) async fn list_free_games(
    caller: Caller,
    page: Page<GameId>,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Paged<GameView>, Problem> {
    let games = game::free(&app, Viewer::of(&caller), id).await?;
    page.cut(games, |game| game.id)
}

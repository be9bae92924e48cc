//! Teams: creating, changing and retiring them.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{self, Confirmation, NewTeam},
    token::{Secret, SecretKind},
    views::team::{TeamView, TeamWithToken},
};
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::teams,
    views::team,
};
use faceoff_types::{TeamId, TeamName};

/// Creates a team. Its token is returned only once.
#[utoipa::path(
    post, path = "/teams", tag = "organiser", security(("organiser" = [])), request_body = NewTeam,
    responses(
        (status = 201, body = TeamWithToken),
        (status = 409, description = "the name is taken"),
        (status = 422, description = "not a valid team name"),
    )
)]
pub(crate) async fn create_team(
    organiser: Organiser,
    State(app): State<App>,
    Body(request): Body<NewTeam>,
) -> Result<(StatusCode, Json<TeamWithToken>), Problem> {
    let name: TeamName = request
        .name
        .parse()
        .map_err(|error| Problem::invalid("name", error))?;
    let token = Secret::generate(SecretKind::Team).map_err(Problem::internal)?;
    let now = app.config.clock.now();
    let team = app
        .store
        .create_team(
            organiser.actor(),
            &name,
            token.hash(),
            organiser.requester(),
            now,
        )
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team created");
    let view = TeamWithToken {
        team: team::view(team),
        token: token.as_str().to_owned(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// Lists all teams.
#[utoipa::path(
    get, path = "/teams", tag = "organiser", security(("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<TeamView>))
)]
pub(crate) async fn list_teams(
    _: Organiser,
    page: Page<TeamId>,
    State(app): State<App>,
) -> Result<Paged<TeamView>, Problem> {
    page.select(team::all(&app).await?, |team| team.id)
}

/// Replaces all of a team's tokens by a new one; the old ones become invalid. Tokens of its members are not affected.
#[utoipa::path(
    post, path = "/teams/{id}/token", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)),
    responses((status = 200, body = TeamWithToken), (status = 404))
)]
pub(crate) async fn replace_token(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamWithToken>, Problem> {
    let team = team::find(&app, id).await?;
    let token = Secret::generate(SecretKind::Team).map_err(Problem::internal)?;
    let now = app.config.clock.now();
    app.store
        .set_team_token(
            organiser.actor(),
            id,
            token.hash(),
            organiser.requester(),
            now,
        )
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team token replaced");
    Ok(Json(TeamWithToken {
        team,
        token: token.as_str().to_owned(),
    }))
}

/// Changes a team's name or profile. For organisers and members; division and baseline for organisers only.
#[utoipa::path(
    patch, path = "/teams/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = requests::TeamChange,
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "the name is taken, there is no such division, ranks of a signed-off board would change, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(change): Body<requests::TeamChange>,
) -> Result<Json<TeamView>, Problem> {
    teams::change_team(&app, &caller, id, change).await?;
    team::find(&app, id).await.map(Json)
}

/// Retires a team at its own request: it can neither upload nor be evaluated; its results stay.
#[utoipa::path(
    post, path = "/teams/{id}/retire", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), or the team has already retired"),
    )
)]
pub(crate) async fn retire_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<TeamView>, Problem> {
    let team = teams::find_editable(&app, &caller, id).await?;
    let effect = format!(
        "the team {} can neither upload nor be evaluated from now on; evaluations whose cutoff has passed continue, and its results \
         stay",
        team.name
    );
    Problem::check_confirmed(confirm.as_deref(), team.name.as_str(), &effect)?;
    let now = app.config.clock.now();
    let team = app.store.retire_team(caller.actor(), id, now).await?;
    tracing::info!(team = %team.name, %id, actor = %caller.actor(), "team retired");
    Ok(Json(team::view(team)))
}

/// Undoes the retirement of a team.
#[utoipa::path(
    post, path = "/teams/{id}/return", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)),
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "the team has not retired"),
    )
)]
pub(crate) async fn return_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamView>, Problem> {
    teams::find_editable(&app, &caller, id).await?;
    let now = app.config.clock.now();
    let team = app.store.return_team(caller.actor(), id, now).await?;
    tracing::info!(team = %team.name, %id, actor = %caller.actor(), "team returned");
    Ok(Json(team::view(team)))
}

/// Returns a team's public profile.
#[utoipa::path(
    get, path = "/teams/{id}", tag = "public", params(("id" = TeamId, Path)),
    responses((status = 200, body = TeamView), (status = 404))
)]
pub(crate) async fn team(
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamView>, Problem> {
    team::find(&app, id).await.map(Json)
}

//! Teams: invited, described, renamed, retired.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{self, Confirmation, NewTeam},
    token::{Secret, SecretKind},
    views::team::{TeamView, TeamWithToken},
};
use faceoff_service::{
    acts::teams,
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::team,
};
use faceoff_types::{TeamId, TeamName};

/// Creates a team and returns its token, once.
#[utoipa::path(
    post, path = "/teams", tag = "organiser", security(("organiser" = [])), request_body = NewTeam,
    responses(
        (status = 201, body = TeamWithToken),
        (status = 409, description = "the name is taken"),
        (status = 422, description = "not a team name"),
    )
)]
pub(crate) async fn create_team(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewTeam>,
) -> Result<(StatusCode, Json<TeamWithToken>), Problem> {
    let name: TeamName = new
        .name
        .parse()
        .map_err(|error| Problem::invalid("name", error))?;
    let token = Secret::generate(SecretKind::Team).map_err(Problem::internal)?;
    let now = app.config.clock.now();
    let team = app
        .store
        .create_team(organiser.actor(), &name, token.hash(), now)
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team created");
    let view = TeamWithToken {
        team: team::of(team),
        token: token.as_str().to_owned(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// All teams.
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
    page.cut(team::all(&app).await?, |team| team.id)
}

/// Replaces a team's own tokens by a new one; the old ones are worth nothing from now on. Its members' stay.
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
        .set_team_token(organiser.actor(), id, token.hash(), now)
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team token replaced");
    Ok(Json(TeamWithToken {
        team,
        token: token.as_str().to_owned(),
    }))
}

/// Changes a team's name, or what it tells of itself. By an organiser or a member; the division, and whether it is a baseline, by an organiser alone.
#[utoipa::path(
    patch, path = "/teams/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = requests::TeamChange,
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "the name is taken, there is no such division, a board that is signed off would have other ranks, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(change): Body<requests::TeamChange>,
) -> Result<Json<TeamView>, Problem> {
    let changed = teams::change_team(&app, &caller, id, change);
    changed.await.map(Json)
}

/// Takes a team out of all days to come, by its own wish: it neither uploads nor plays; its results stay.
#[utoipa::path(
    post, path = "/teams/{id}/retire", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), or it has retired"),
    )
)]
pub(crate) async fn retire_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<TeamView>, Problem> {
    let team = teams::own(&app, &caller, id).await?;
    let what = format!(
        "{} would neither upload nor enter a day from now on; what had its cut goes on, and its results stay",
        team.name
    );
    Problem::check_confirmed(confirm.as_deref(), team.name.as_str(), &what)?;
    let now = app.config.clock.now();
    let team = app.store.retire_team(caller.actor(), id, now).await?;
    tracing::info!(team = %team.name, %id, actor = %caller.actor(), "team retired");
    Ok(Json(team::of(team)))
}

/// Lets a team that has retired play again.
#[utoipa::path(
    post, path = "/teams/{id}/return", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)),
    responses(
        (status = 200, body = TeamView),
        (status = 403), (status = 404),
        (status = 409, description = "it has not retired"),
    )
)]
pub(crate) async fn return_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamView>, Problem> {
    teams::own(&app, &caller, id).await?;
    let now = app.config.clock.now();
    let team = app.store.return_team(caller.actor(), id, now).await?;
    tracing::info!(team = %team.name, %id, actor = %caller.actor(), "team returned");
    Ok(Json(team::of(team)))
}

/// One team, as everybody may know it.
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

//! Teams and their tokens.

use crate::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    requests::NewTeam,
    token::{Token, TokenKind},
    views::team::{TeamView, TeamWithToken},
};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_store::Actor;
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
    _: Organiser,
    State(app): State<App>,
    Body(new): Body<NewTeam>,
) -> Result<(StatusCode, Json<TeamWithToken>), Problem> {
    let name: TeamName = new
        .name
        .parse()
        .map_err(|error| Problem::invalid("name", error))?;
    let token = Token::generate(TokenKind::Team).map_err(Problem::internal)?;
    let now = app.config.clock.now();
    let team = app
        .store
        .create_team(Actor::Organiser, &name, token.hash(), now)
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team created");
    let view = TeamWithToken {
        team: team.into(),
        token: token.as_str().to_owned(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// All teams.
#[utoipa::path(
    get, path = "/teams", tag = "organiser", security(("organiser" = [])),
    responses((status = 200, body = Vec<TeamView>))
)]
pub(crate) async fn list_teams(
    _: Organiser,
    State(app): State<App>,
) -> Result<Json<Vec<TeamView>>, Problem> {
    TeamView::all(&app).await.map(Json)
}

/// Replaces a team's token; the old one is worth nothing from now on.
#[utoipa::path(
    post, path = "/teams/{id}/token", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)),
    responses((status = 200, body = TeamWithToken), (status = 404))
)]
pub(crate) async fn replace_token(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamWithToken>, Problem> {
    let team = TeamView::find(&app, id).await?;
    let token = Token::generate(TokenKind::Team).map_err(Problem::internal)?;
    let now = app.config.clock.now();
    app.store
        .set_team_token(Actor::Organiser, id, token.hash(), now)
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team token replaced");
    Ok(Json(TeamWithToken {
        team,
        token: token.as_str().to_owned(),
    }))
}

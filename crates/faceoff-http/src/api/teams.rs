//! Teams and their tokens.

use super::schema::ProblemBody;
use crate::{
    App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    token::{Token, TokenKind},
};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_store::{Actor, Team};
use faceoff_types::{TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TeamView {
    /// Its id.
    #[schema(value_type = String, format = Uuid)]
    pub id: TeamId,
    /// Its name on the board.
    #[schema(value_type = String, example = "AiRLIHockey")]
    pub name: TeamName,
    /// When it was created.
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Timestamp,
}

impl From<Team> for TeamView {
    fn from(team: Team) -> Self {
        Self {
            id: team.id,
            name: team.name,
            created_at: team.created_at,
        }
    }
}

/// A team and its new token, which is shown this once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct TeamWithToken {
    /// The team.
    #[serde(flatten)]
    pub team: TeamView,
    /// The bearer token; only its hash is stored.
    #[schema(example = "fo_team_…")]
    pub token: String,
}

/// A team to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTeam {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: String,
}

/// Creates a team and returns its token, once.
#[utoipa::path(
    post, path = "/teams", tag = "organiser", security(("organiser" = [])), request_body = NewTeam,
    responses(
        (status = 201, body = TeamWithToken),
        (status = 409, description = "the name is taken", body = ProblemBody, content_type = "application/problem+json"),
        (status = 422, description = "not a team name", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn create_team(
    _: Organiser,
    State(app): State<App>,
    Body(new): Body<NewTeam>,
) -> Result<(StatusCode, Json<TeamWithToken>), Problem> {
    let name: TeamName = new.name.parse().map_err(|error| {
        Problem::new(ProblemKind::InvalidContent, format!("name: {error}")).with("field", "name")
    })?;
    let token = Token::generate(TokenKind::Team).map_err(Problem::internal)?;
    let team = app
        .store
        .create_team(
            Actor::Organiser,
            &name,
            token.hash(),
            app.config.clock.now(),
        )
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
    let teams = app.store.teams().await?;
    Ok(Json(teams.into_iter().map(TeamView::from).collect()))
}

/// Replaces a team's token; the old one is worth nothing from now on.
#[utoipa::path(
    post, path = "/teams/{id}/token", tag = "organiser", security(("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = TeamWithToken),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn replace_token(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<TeamWithToken>, Problem> {
    let team = app.store.team(id).await?;
    let token = Token::generate(TokenKind::Team).map_err(Problem::internal)?;
    app.store
        .set_team_token(Actor::Organiser, id, token.hash(), app.config.clock.now())
        .await?;
    tracing::info!(team = %team.name, id = %team.id, "team token replaced");
    Ok(Json(TeamWithToken {
        team: team.into(),
        token: token.as_str().to_owned(),
    }))
}

//! Teams, and their tokens as they are handed out.

use super::ruling::RulingView;
use crate::{app::AppState, problem::Problem};
use faceoff_store::Team;
use faceoff_types::{DivisionName, TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TeamView {
    /// Names the team in paths; a name may hold spaces.
    pub id: TeamId,
    /// As the board shows it.
    #[schema(example = "AiRLIHockey")]
    pub name: TeamName,
    /// When it came.
    pub created_at: Timestamp,
    /// It neither plays nor is ranked, if it is; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disqualified: Option<RulingView>,
    /// Where it is from; null: it does not say.
    #[serde(default)]
    pub affiliation: Option<String>,
    /// Its page; null: none.
    #[serde(default)]
    pub link: Option<String>,
    /// The division that it is in; null: none.
    #[serde(default)]
    pub division: Option<DivisionName>,
    /// Since when it plays no more, by its own wish; null: it plays.
    #[serde(default)]
    pub retired_at: Option<Timestamp>,
    /// It is a reference agent of the organisers: boards show it apart and do not rank it; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub baseline: bool,
    /// Does it play no friendly games that other teams ask for? Told of a single team; absent in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declines_friendly_games: Option<bool>,
}

impl From<Team> for TeamView {
    fn from(team: Team) -> Self {
        Self {
            id: team.id,
            name: team.name,
            created_at: team.created_at,
            disqualified: team.disqualified.map(RulingView::from),
            affiliation: team.profile.affiliation,
            link: team.profile.link,
            division: team.profile.division,
            retired_at: team.retired_at,
            baseline: team.is_baseline,
            declines_friendly_games: None,
        }
    }
}

impl TeamView {
    pub(crate) async fn find(app: &AppState, id: TeamId) -> Result<Self, Problem> {
        Ok(Self {
            declines_friendly_games: Some(app.store.declines_friendly_games(id).await?),
            ..app.store.team(id).await?.into()
        })
    }

    /// All teams, by name.
    pub(crate) async fn all(app: &AppState) -> Result<Vec<Self>, Problem> {
        let teams = app.store.teams().await?;
        Ok(teams.into_iter().map(Self::from).collect())
    }
}

/// A team and its new token, which is shown this once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct TeamWithToken {
    /// Whose token it is.
    #[serde(flatten)]
    pub team: TeamView,
    /// The bearer token; only its hash is stored.
    #[schema(example = "fo_team_…")]
    pub token: String,
}

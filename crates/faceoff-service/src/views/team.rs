//! Teams: name, profile and state.

use crate::{app::AppState, boxed_future, problem::Problem, views::decision};
use faceoff_api::views::team::TeamView;
use faceoff_store::Team;
use faceoff_types::TeamId;

/// A team, without the setting whether it declines friendly games (games against another team that do not count).
pub fn view(team: Team) -> TeamView {
    TeamView {
        id: team.id,
        name: team.name,
        created_at: team.created_at,
        disqualified: team.disqualified.map(decision::view),
        affiliation: team.profile.affiliation,
        link: team.profile.link,
        division: team.profile.division,
        retired_at: team.retired_at,
        baseline: team.is_baseline,
        declines_friendly_games: None,
    }
}

/// A team, including that setting.
#[boxed_future]
pub async fn find(app: &AppState, id: TeamId) -> Result<TeamView, Problem> {
    Ok(TeamView {
        declines_friendly_games: Some(app.store.declines_friendly_games(id).await?),
        ..view(app.store.team(id).await?)
    })
}

/// All teams, by name.
#[boxed_future]
pub async fn all(app: &AppState) -> Result<Vec<TeamView>, Problem> {
    let teams = app.store.teams().await?;
    Ok(teams.into_iter().map(view).collect())
}

//! Entrants: the teams that take part in a tournament.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{board, tournament_state::TournamentState, visibility::Visibility},
};
use faceoff_api::requests::BoardQuery;
use faceoff_scoring::tournament::schedule::MAX_ENTRANTS;
use faceoff_store::{Actor, Stage};
use faceoff_types::{TeamId, TeamName, Tier, TournamentId};
use std::collections::{BTreeMap, BTreeSet};

/// The teams with these names, ignoring case.
///
/// # Errors
/// `InvalidContent`, for the request's `field`: a name is unknown, or occurs twice.
#[boxed_future]
pub async fn find_by_names(
    app: &AppState,
    field: &str,
    names: &[TeamName],
) -> Result<Vec<TeamId>, Problem> {
    let lowercase = |name: &TeamName| name.as_str().to_lowercase();
    let teams = app.store.teams().await?.into_iter();
    let teams: BTreeMap<String, TeamId> =
        teams.map(|team| (lowercase(&team.name), team.id)).collect();
    let mut ids = Vec::new();
    let mut seen_ids = BTreeSet::new();
    for name in names {
        let Some(id) = teams.get(&lowercase(name)) else {
            let detail = format!("there is no team {:?}; check the name", name.as_str());
            return Err(Problem::invalid(field, detail));
        };
        if !seen_ids.insert(*id) {
            let detail = format!("expected each team once, got {name} twice; remove one of them");
            return Err(Problem::invalid(field, detail));
        }
        ids.push(*id);
    }
    Ok(ids)
}

/// Enters the teams with these names into a tournament.
///
/// # Errors
/// `InvalidContent`: there is no name, or it is unknown; `Conflict` if a team has entered or left, or no more can enter.
#[boxed_future]
pub async fn enter_teams(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    names: &[TeamName],
) -> Result<(), Problem> {
    if names.is_empty() {
        return Err(Problem::invalid(
            "teams",
            "expected at least one name, got none",
        ));
    }
    let state = TournamentState::without_standings(app, id).await?;
    let new_entrants = find_by_names(app, "teams", names).await?;
    check_count(state.entrants.len() + new_entrants.len())?;
    let now = app.config.clock.now();
    app.store
        .add_entrants(actor, id, &new_entrants, now)
        .await?;
    tracing::info!(tournament = %id, teams = new_entrants.len(), "teams entered");
    Ok(())
}

/// Refuses more entrants than a schedule supports. Teams that have left the tournament count.
pub fn check_count(teams: usize) -> Result<(), Problem> {
    if teams > MAX_ENTRANTS {
        let detail = format!(
            "expected at most {MAX_ENTRANTS} teams, got {teams}; split them into several tournaments"
        );
        return Err(Problem::invalid("teams", detail));
    }
    Ok(())
}

/// The teams that qualify for a tournament by their results in a stage. These are the teams in the two better *tiers* (grades of
/// safety: deployable, improvable) on the stage's live board under its newest rules, without retired teams. In a
/// competition without tiers all teams of the board qualify. The live board also has results after a freeze of the boards.
#[boxed_future]
pub async fn qualified_teams(app: &AppState, stage: &Stage) -> Result<Vec<TeamId>, Problem> {
    let query = BoardQuery {
        stage: Some(stage.id),
        live: true,
        ..BoardQuery::default()
    };
    let visibility = Visibility::for_organiser(app).await?;
    let board = board::query(app, &visibility, query, None).await?;
    let teams = app.store.teams().await?.into_iter();
    let retired: BTreeSet<TeamId> = teams
        .filter(|team| team.retired_at.is_some())
        .map(|team| team.id)
        .collect();
    let qualified = board
        .rows
        .into_iter()
        .filter(|row| row.tier != Some(Tier::NonDeployable) && !retired.contains(&row.team_id));
    Ok(qualified.map(|row| row.team_id).collect())
}

//! Who enters a tournament.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{board, sight::Sight},
};
use faceoff_api::requests::BoardQuery;
use faceoff_scoring::tournament::schedule::MAX_ENTRANTS;
use faceoff_store::Stage;
use faceoff_types::{TeamId, TeamName, Tier};
use std::collections::{BTreeMap, BTreeSet};

/// The teams of these names, whatever the case of their letters.
///
/// # Errors
/// `InvalidContent`: there is none, or one is named twice.
#[boxed]
pub async fn named(
    app: &AppState,
    field: &str,
    names: &[TeamName],
) -> Result<Vec<TeamId>, Problem> {
    let folded = |name: &TeamName| name.as_str().to_lowercase();
    let teams = app.store.teams().await?.into_iter();
    let teams: BTreeMap<String, TeamId> = teams.map(|team| (folded(&team.name), team.id)).collect();
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    for name in names {
        let Some(id) = teams.get(&folded(name)) else {
            let detail = format!("there is no team {:?}; check the name", name.as_str());
            return Err(Problem::invalid(field, detail));
        };
        if !seen.insert(*id) {
            let detail = format!("{name} is named twice; name each team once");
            return Err(Problem::invalid(field, detail));
        }
        found.push(*id);
    }
    Ok(found)
}

/// Refuses more teams than a schedule is drawn for; those that left count.
pub fn check_count(teams: usize) -> Result<(), Problem> {
    if teams > MAX_ENTRANTS {
        let detail =
            format!("a tournament has at most {MAX_ENTRANTS} teams, got {teams}; divide them");
        return Err(Problem::invalid("teams", detail));
    }
    Ok(())
}

/// The teams that a stage's board has as deployable or improvable, the organiser's board, by the newest rules: those
/// that have not retired.
#[boxed]
pub async fn by_tier(app: &AppState, stage: &Stage) -> Result<Vec<TeamId>, Problem> {
    let query = BoardQuery {
        stage: Some(stage.id),
        live: true,
        ..BoardQuery::default()
    };
    let sight = Sight::of_organiser(app).await?;
    let board = board::asked(app, &sight, query, None).await?;
    let teams = app.store.teams().await?.into_iter();
    let retired: BTreeSet<TeamId> = teams
        .filter(|team| team.retired_at.is_some())
        .map(|team| team.id)
        .collect();
    let entering = board.rows.into_iter().filter(|row| {
        matches!(row.tier, Tier::Deployable | Tier::Improvable) && !retired.contains(&row.team_id)
    });
    Ok(entering.map(|row| row.team_id).collect())
}

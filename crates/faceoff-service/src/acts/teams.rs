//! What is changed of teams, by themselves and by organisers.

use super::joining::profile;
use crate::{
    app::AppState,
    auth::Caller,
    boxed,
    problem::{Problem, ProblemKind},
    views::team,
};
use faceoff_api::{
    requests::{self, SeasonChange},
    views::team::TeamView,
};
use faceoff_store::{Actor, Team, TeamChange, TeamProfile};
use faceoff_types::TeamId;

/// The caller's own team, or any for an organiser.
#[boxed]
pub async fn own(app: &AppState, caller: &Caller, id: TeamId) -> Result<Team, Problem> {
    let team = app.store.team(id).await;
    let team = caller.visible("team", team, |team| team.id)?;
    // Whoever finds a team's token must not rename it, or take it out of the season.
    if caller.person().is_none() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's own token changes nothing of the team; a member does, or an organiser",
        ));
    }
    Ok(team)
}

/// Changes a team's name, or what it tells of itself; some of it by organisers alone.
#[boxed]
pub async fn change_team(
    app: &AppState,
    caller: &Caller,
    id: TeamId,
    change: requests::TeamChange,
) -> Result<TeamView, Problem> {
    let team = own(app, caller, id).await?;
    if change.division.is_some() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "division: only an organiser puts a team into another division",
        ));
    }
    if change.baseline.is_some() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "baseline: only an organiser says which team is a baseline",
        ));
    }
    let described = requests::FoundedTeam {
        name: change.name.clone().unwrap_or_else(|| team.name.clone()),
        affiliation: change.affiliation.unwrap_or(team.profile.affiliation),
        link: change.link.unwrap_or(team.profile.link),
        division: change.division.unwrap_or(team.profile.division),
    };
    let declines = change.declines_friendly_games;
    let (_, profile): (_, TeamProfile) = profile(described)?;
    let change = TeamChange {
        name: change.name,
        profile: Some(profile),
        baseline: change.baseline,
    };
    let now = app.config.clock.now();
    let team = app
        .store
        .change_team(caller.actor(), id, change, now)
        .await?;
    if let Some(declines) = declines {
        app.store
            .set_declines_friendly_games(caller.actor(), id, declines, now)
            .await?;
    }
    tracing::info!(team = %team.name, %id, actor = %caller.actor(), "team changed");
    team::find(app, id).await
}

/// Changes whether teams may register, and the divisions.
#[boxed]
pub async fn change_season(
    app: &AppState,
    actor: Actor,
    change: &SeasonChange,
) -> Result<(), Problem> {
    let now = app.config.clock.now();
    let (registrations, divisions) = (change.takes_registrations, change.divisions.as_deref());
    app.store
        .change_season(actor, registrations, divisions, now)
        .await?;
    Ok(())
}

//! Changes of a team's name and profile, and of the season's settings for registrations and divisions. A *division* is a group of
//! teams that are ranked among themselves; a *baseline* is a team of the organisers, for comparison, without a rank.

use super::accounts::checked_profile;
use crate::{
    app::AppState,
    auth::Caller,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_api::requests::{self, SeasonChange};
use faceoff_store::{Actor, Team, TeamChange, TeamProfile};
use faceoff_types::TeamId;

/// The team, if the caller may change it: a member their own, an organiser any.
#[boxed_future]
pub async fn find_editable(app: &AppState, caller: &Caller, id: TeamId) -> Result<Team, Problem> {
    let team = app.store.team(id).await;
    let team = caller.visible("team", team, |team| team.id)?;
    // A leaked team token must not rename the team or retire it.
    if caller.user().is_none() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's token cannot change the team; use a member's token, or an organiser's",
        ));
    }
    Ok(team)
}

/// Changes a team's name or profile. Only organisers change its division and whether it is a baseline.
#[boxed_future]
pub async fn change_team(
    app: &AppState,
    caller: &Caller,
    id: TeamId,
    change: requests::TeamChange,
) -> Result<Team, Problem> {
    let team = find_editable(app, caller, id).await?;
    if change.division.is_some() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "division: only an organiser can change a team's division",
        ));
    }
    if change.baseline.is_some() && !caller.is_organiser() {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "baseline: only an organiser can change whether a team is a baseline",
        ));
    }
    let changed_team = requests::FoundedTeam {
        name: change.name.clone().unwrap_or_else(|| team.name.clone()),
        affiliation: change.affiliation.unwrap_or(team.profile.affiliation),
        link: change.link.unwrap_or(team.profile.link),
        division: change.division.unwrap_or(team.profile.division),
    };
    let declines = change.declines_friendly_games;
    let (_, profile): (_, TeamProfile) = checked_profile(changed_team)?;
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
    Ok(team)
}

/// Changes whether teams can register, and the divisions.
#[boxed_future]
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

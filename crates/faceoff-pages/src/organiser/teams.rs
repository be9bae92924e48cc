//! `/organiser/teams`: teams, registrations and divisions.

use super::form_lines;
use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::{
    requests::{SeasonChange, TeamChange},
    views::{invitation::RegistrationView, team::TeamView},
};
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    services::teams,
    views::{invitation, team},
};
use faceoff_types::{DivisionName, TeamId};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "organiser_teams.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    teams: Vec<TeamView>,
    /// Registrations that wait for approval, and those that were approved or refused.
    pending: Vec<RegistrationView>,
    decided: Vec<RegistrationView>,
    divisions: Vec<DivisionName>,
    season: SeasonForm,
}

const PATH: &str = "/organiser/teams";

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    notice: Notice<'_>,
    form: Option<SeasonForm>,
) -> Result<Response, PageProblem> {
    let registrations = app.store.registrations().await?;
    let registrations = registrations.into_iter().map(invitation::registration);
    let (pending, decided) =
        registrations.partition(|registration| registration.state == "waiting");
    let divisions = app.store.divisions().await?;
    let season = app.store.season().await?;
    let form = form.unwrap_or_else(|| SeasonForm {
        takes_registrations: match season.registration_open {
            true => "on".to_owned(),
            false => String::new(),
        },
        divisions: divisions
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n"),
    });
    let page = Page {
        frame: Frame::load(app, PATH).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        teams: team::all(app).await?,
        pending,
        decided,
        divisions,
        season: form,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &user, Notice::Done(&notice), None).await
}

/// Settings of a team that only organisers can change.
#[derive(Deserialize)]
pub(super) struct TeamForm {
    #[serde(default)]
    division: String,
    /// Checkbox: not sent if it is not ticked.
    #[serde(default)]
    baseline: String,
}

fn team_change(form: &TeamForm) -> Result<TeamChange, Problem> {
    let division = Some(form.division.trim()).filter(|name| !name.is_empty());
    let division = division.map(str::parse).transpose();
    Ok(TeamChange {
        division: Some(division.map_err(|error| Problem::invalid("division", error))?),
        baseline: Some(!form.baseline.is_empty()),
        ..TeamChange::default()
    })
}

/// Changes the division of a team and whether it is a reference agent.
pub(super) async fn change(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<TeamId>, Problem>,
    form: Result<PageForm<TeamForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let changed = match team_change(&form) {
        Ok(change) => teams::change_team(&app, &user.caller, id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(redirect_done(PATH, "team-changed")),
        Err(problem) => page_with(&app, &user, Notice::Refused(&problem), None).await,
    }
}

#[derive(Deserialize)]
pub(super) struct SeasonForm {
    #[serde(default)]
    pub(super) takes_registrations: String,
    /// One name per line.
    #[serde(default)]
    pub(super) divisions: String,
}

fn season_change(form: &SeasonForm) -> Result<SeasonChange, Problem> {
    Ok(SeasonChange {
        takes_registrations: Some(!form.takes_registrations.is_empty()),
        divisions: Some(form_lines::parse("divisions", &form.divisions)?),
    })
}

/// Opens or closes registration, and changes the divisions.
pub(super) async fn change_season(
    user: PageOrganiser,
    State(app): State<App>,
    form: Result<PageForm<SeasonForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let actor = user.organiser.actor();
    let changed = match season_change(&form) {
        Ok(change) => teams::change_season(&app, actor, &change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(()) => Ok(redirect_done(PATH, "season-changed")),
        Err(problem) => page_with(&app, &user, Notice::Refused(&problem), Some(form)).await,
    }
}

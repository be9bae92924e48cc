//! `/organiser/teams`: who takes part, who wants to, in which division, and who asks for it.

use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    figures::minute,
    frame::{Frame, PageProblem},
    signed_in::Organising,
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
    acts::teams,
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    views::{invitation, season::SeasonHead, team},
};
use faceoff_types::{DivisionName, TeamId};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "organiser_teams.html")]
struct Page {
    frame: Frame,
    head: Head,
    teams: Vec<TeamView>,
    waiting: Vec<RegistrationView>,
    decided: Vec<RegistrationView>,
    divisions: Vec<DivisionName>,
    season: SeasonForm,
}

impl Page {
    fn at(&self, at: &jiff::Timestamp) -> String {
        minute(*at)
    }
}

const PATH: &str = "/organiser/teams";

async fn page_with(
    app: &App,
    organising: &Organising,
    said: Said<'_>,
    filled: Option<SeasonForm>,
) -> Result<Response, PageProblem> {
    let registrations = app.store.registrations().await.map_err(Problem::from)?;
    let registrations = registrations.into_iter().map(invitation::registration);
    let (waiting, decided) = registrations.partition(|one| one.state == "waiting");
    let divisions = app.store.divisions().await.map_err(Problem::from)?;
    let season = app.store.season().await.map_err(Problem::from)?;
    let form = filled.unwrap_or_else(|| SeasonForm {
        takes_registrations: match season.takes_registrations {
            true => "on".to_owned(),
            false => String::new(),
        },
        divisions: divisions
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n"),
    });
    let name = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, name, PATH),
        head: Head::of(&organising.caller, PATH, said),
        teams: team::all(app).await?,
        waiting,
        decided,
        divisions,
        season: form,
    };
    render_desk(&page, said)
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &organising, Said::Done(&said), None).await
}

/// What of a team only organisers change.
#[derive(Deserialize)]
pub(super) struct TeamForm {
    #[serde(default)]
    division: String,
    /// Ticked, or not sent.
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

/// Puts a team into a division, or makes it a reference agent.
pub(super) async fn change(
    organising: Organising,
    State(app): State<App>,
    id: Result<PathParam<TeamId>, Problem>,
    form: Result<PageForm<TeamForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let changed = match team_change(&form) {
        Ok(change) => teams::change_team(&app, &organising.caller, id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(done(PATH, "team-changed")),
        Err(problem) => page_with(&app, &organising, Said::Refused(&problem), None).await,
    }
}

#[derive(Deserialize)]
pub(super) struct SeasonForm {
    #[serde(default)]
    pub(super) takes_registrations: String,
    /// A name a line.
    #[serde(default)]
    pub(super) divisions: String,
}

fn season_change(form: &SeasonForm) -> Result<SeasonChange, Problem> {
    let names = form.divisions.lines().map(str::trim);
    let names = names.filter(|name| !name.is_empty()).map(str::parse);
    let divisions: Result<Vec<DivisionName>, _> = names.collect();
    Ok(SeasonChange {
        takes_registrations: Some(!form.takes_registrations.is_empty()),
        divisions: Some(divisions.map_err(|error| Problem::invalid("divisions", error))?),
    })
}

/// Changes whether teams may register, and the divisions.
pub(super) async fn change_season(
    organising: Organising,
    State(app): State<App>,
    form: Result<PageForm<SeasonForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let actor = organising.organiser.actor();
    let changed = match season_change(&form) {
        Ok(change) => teams::change_season(&app, actor, &change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(()) => Ok(done(PATH, "season-changed")),
        Err(problem) => page_with(&app, &organising, Said::Refused(&problem), Some(form)).await,
    }
}

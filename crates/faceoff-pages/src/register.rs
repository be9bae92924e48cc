//! `/register`: registration of a team.

use super::{
    format,
    frame::{Frame, PageProblem, render},
    join::{parse_accepted_terms, parse_team},
};
use askama::Template;
use axum::{
    extract::State,
    http::StatusCode,
    response::{IntoResponse, Response},
};
use faceoff_api::{
    requests::RegistrationRequest,
    views::{announcement::TermsView, invitation::NewRegistrationView},
};
use faceoff_service::{
    app::App, extract::PageForm, problem::Problem, services::registrations, views::announcement,
};
use faceoff_types::DivisionName;
use serde::Deserialize;

#[derive(Template)]
#[template(path = "register.html")]
struct Page {
    frame: Frame,
    is_open: bool,
    terms: Option<TermsView>,
    divisions: Vec<DivisionName>,
    form: Form,
    error: Option<String>,
    /// The registration that the form has just made, with its link.
    registered: Option<NewRegistrationView>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(super) struct Form {
    team_name: String,
    affiliation: String,
    link: String,
    division: String,
    contact: String,
    accepted_terms: String,
}

async fn page_with(
    app: &App,
    form: Form,
    error: Option<String>,
    registered: Option<NewRegistrationView>,
) -> Result<Response, PageProblem> {
    let season = app.store.season().await?;
    let terms = app.store.terms().await?;
    render(&Page {
        frame: Frame::load(app, "/register").await?,
        is_open: season.registration_open && season.closed_at.is_none(),
        terms: terms.into_iter().next().map(announcement::terms),
        divisions: app.store.divisions().await?,
        form,
        error,
        registered,
    })
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    page_with(&app, Form::default(), None, None).await
}

async fn register_team(app: &App, form: &Form) -> Result<NewRegistrationView, Problem> {
    let team = parse_team(
        &form.team_name,
        &form.affiliation,
        &form.link,
        &form.division,
    )?;
    let request = RegistrationRequest {
        team: team
            .ok_or_else(|| Problem::invalid("the team's name", "expected a name, got none"))?,
        contact: form.contact.clone(),
        accepted_terms: parse_accepted_terms(&form.accepted_terms)?,
    };
    registrations::register(app, request).await
}

/// Registers the team and shows its link, or shows an error on the same page.
pub(super) async fn submit(
    State(app): State<App>,
    PageForm(form): PageForm<Form>,
) -> Result<Response, PageProblem> {
    match register_team(&app, &form).await {
        Ok(registered) => {
            let page = page_with(&app, Form::default(), None, Some(registered)).await?;
            Ok((StatusCode::CREATED, page).into_response())
        }
        Err(problem) if problem.kind().status().is_client_error() => {
            let status = problem.kind().status();
            let error = Some(format::sentence(problem.detail()));
            let page = page_with(&app, form, error, None).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem.into()),
    }
}

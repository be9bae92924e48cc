//! `/join/CODE`: accepting an invitation. The code is the secret of the link.

use super::{
    format,
    frame::{Frame, PageProblem, render},
    sign_in::redirect_to_dashboard,
};
use askama::Template;
use axum::{
    extract::State,
    http::{HeaderMap, Uri},
    response::{IntoResponse, Response},
};
use faceoff_api::{
    requests::{FoundedTeam, JoinRequest},
    secret_extraction::extract_secret,
    token::hash_token,
    views::announcement::TermsView,
};
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    network::{ClientNetwork, Network},
    problem::{Problem, ProblemKind},
    services::{accounts::join, sessions::session_expiry},
    session,
    views::announcement,
};
use faceoff_store::{CodeStatus, InvitationRole, RegistrationState, TokenKind};
use faceoff_types::DivisionName;
use serde::Deserialize;

/// What the code of the link offers.
enum Offer {
    Organiser,
    /// Membership of the named team.
    Member(String),
    Founder,
    /// Access for an existing user again, with a new password.
    RestoreAccess,
    /// The registration of the named team is waiting for approval.
    PendingRegistration(String),
    /// The registration of the named team was refused, with the reason.
    RefusedRegistration(String, String),
}

impl Offer {
    /// Can the offer be accepted?
    const fn is_open(&self) -> bool {
        !matches!(
            self,
            Self::PendingRegistration(_) | Self::RefusedRegistration(..)
        )
    }
}

#[derive(Template)]
#[template(path = "join.html")]
struct Page {
    frame: Frame,
    offer: Offer,
    terms: Option<TermsView>,
    divisions: Vec<DivisionName>,
    form: Form,
    min_password_chars: usize,
    error: Option<String>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(super) struct Form {
    name: String,
    password: String,
    team_name: String,
    affiliation: String,
    link: String,
    division: String,
    accepted_terms: String,
}

/// Trimmed text; `None` if it is empty.
fn non_empty(text: &str) -> Option<String> {
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// The new team of a form, if the form names one.
pub(super) fn parse_team(
    name: &str,
    affiliation: &str,
    link: &str,
    division: &str,
) -> Result<Option<FoundedTeam>, Problem> {
    let Some(name) = non_empty(name) else {
        return Ok(None);
    };
    let division = non_empty(division).map(|name| name.parse()).transpose();
    Ok(Some(FoundedTeam {
        name: name
            .parse()
            .map_err(|error| Problem::invalid("the team's name", error))?,
        affiliation: non_empty(affiliation),
        link: non_empty(link),
        division: division.map_err(|error| Problem::invalid("division", error))?,
    }))
}

/// The version of the terms that the user accepted.
pub(super) fn parse_accepted_terms(text: &str) -> Result<Option<u32>, Problem> {
    non_empty(text)
        .map(|version| version.parse())
        .transpose()
        .map_err(|error| Problem::invalid("accepted_terms", error))
}

async fn page_with(
    app: &App,
    code: &str,
    form: Form,
    error: Option<String>,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let found = app
        .store
        .code_status(hash_token(extract_secret(code)), now)
        .await;
    let offer = match found? {
        CodeStatus::Invitation(invitation, team) => match invitation.role {
            InvitationRole::Organiser => Offer::Organiser,
            InvitationRole::Member(_) => {
                Offer::Member(team.map(|name| name.to_string()).unwrap_or_default())
            }
            InvitationRole::Founder => Offer::Founder,
            InvitationRole::RestoreAccess(_) => Offer::RestoreAccess,
        },
        CodeStatus::PendingRegistration(registration) => {
            Offer::PendingRegistration(registration.team_name.to_string())
        }
        CodeStatus::RefusedRegistration(registration) => {
            let reason = match registration.state {
                RegistrationState::Refused { reason, .. } => reason,
                RegistrationState::Pending | RegistrationState::Approved { .. } => String::new(),
            };
            Offer::RefusedRegistration(registration.team_name.to_string(), reason)
        }
    };
    let terms = app.store.terms().await?;
    render(&Page {
        frame: Frame::load(app, "/join").await?,
        offer,
        terms: terms.into_iter().next().map(announcement::terms),
        divisions: app.store.divisions().await?,
        form: Form {
            password: String::new(),
            ..form
        },
        min_password_chars: faceoff_service::passwords::MIN_CHARS,
        error,
    })
}

pub(super) async fn page(
    State(app): State<App>,
    PathParam(code): PathParam<String>,
) -> Result<Response, PageProblem> {
    page_with(&app, &code, Form::default(), None).await
}

/// Joins and redirects to the dashboard, or shows an error on the same page.
pub(super) async fn submit(
    State(app): State<App>,
    PathParam(code): PathParam<String>,
    ClientNetwork(client): ClientNetwork,
    uri: Uri,
    headers: HeaderMap,
    PageForm(form): PageForm<Form>,
) -> Result<Response, PageProblem> {
    let accepted = match session::check_cookie_is_kept(&app.config, &headers, uri.path()) {
        Ok(()) => accept_invitation(&app, &code, &form, client).await,
        Err(problem) => Err(problem.into()),
    };
    match accepted {
        Ok(response) => Ok(response),
        // An invalid invitation has its own page; server errors are not shown beside the form.
        Err(PageProblem(problem)) if problem.kind() == ProblemKind::InvitationInvalid => {
            Err(problem.into())
        }
        Err(PageProblem(problem)) if problem.kind().status().is_client_error() => {
            let status = problem.kind().status();
            let error = Some(format::sentence(problem.detail()));
            let page = page_with(&app, &code, form, error).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem),
    }
}

async fn accept_invitation(
    app: &App,
    code: &str,
    form: &Form,
    client: Option<Network>,
) -> Result<Response, PageProblem> {
    let name = non_empty(&form.name).map(|name| name.parse()).transpose();
    let request = JoinRequest {
        code: code.to_owned(),
        name: name.map_err(|error| Problem::invalid("name", error))?,
        password: (!form.password.is_empty()).then(|| form.password.clone()),
        team: parse_team(
            &form.team_name,
            &form.affiliation,
            &form.link,
            &form.division,
        )?,
        accepted_terms: parse_accepted_terms(&form.accepted_terms)?,
    };
    let until = session_expiry(app.config.clock.now());
    let (_, secret) = join(app, request, TokenKind::Session, Some(until), client).await?;
    redirect_to_dashboard(app, secret.as_str())
}

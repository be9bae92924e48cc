//! `/join/CODE`: where an invitation is accepted.

use super::{
    frame::{Frame, PageProblem, render},
    sign_in::signed_in,
};
use askama::Template;
use axum::{
    extract::State,
    response::{IntoResponse, Response},
};
use faceoff_api::{
    requests::{FoundedTeam, Join},
    token::hash_token,
    views::announcement::TermsView,
};
use faceoff_service::{
    acts::{joining::join, signing_in::session_end},
    app::App,
    extract::{PageForm, PathParam},
    problem::{Problem, ProblemKind},
    views::{announcement, season::SeasonHead},
};
use faceoff_store::{Code, InvitedAs, RegistrationState, TokenKind};
use faceoff_types::DivisionName;
use serde::Deserialize;

/// What the code is good for, as the page tells it.
enum Offer {
    /// To become an organiser, a member of the named team, or a founder.
    Organiser,
    Member(String),
    Founder,
    Return,
    /// The registration of the named team waits.
    Waiting(String),
    /// It was refused, with the reason.
    Refused(String, String),
}

impl Offer {
    /// Is there something to accept?
    const fn is_open(&self) -> bool {
        !matches!(self, Self::Waiting(_) | Self::Refused(..))
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
    least_chars: usize,
    refused: Option<String>,
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

/// What was filled in.
fn filled(text: &str) -> Option<String> {
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// The team of a form, if one is named in it.
pub(super) fn founded(
    name: &str,
    affiliation: &str,
    link: &str,
    division: &str,
) -> Result<Option<FoundedTeam>, Problem> {
    let Some(name) = filled(name) else {
        return Ok(None);
    };
    let division = filled(division).map(|name| name.parse()).transpose();
    Ok(Some(FoundedTeam {
        name: name
            .parse()
            .map_err(|error| Problem::invalid("the team's name", error))?,
        affiliation: filled(affiliation),
        link: filled(link),
        division: division.map_err(|error| Problem::invalid("division", error))?,
    }))
}

/// The version of the terms that was accepted by ticking a box.
pub(super) fn accepted(text: &str) -> Result<Option<u32>, Problem> {
    filled(text)
        .map(|version| version.parse())
        .transpose()
        .map_err(|error| Problem::invalid("accepted_terms", error))
}

async fn page_with(
    app: &App,
    code: &str,
    form: Form,
    refused: Option<String>,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let found = app.store.code(hash_token(code), now).await;
    let offer = match found.map_err(Problem::from)? {
        Code::Open(invitation, team) => match invitation.invited_as {
            InvitedAs::Organiser => Offer::Organiser,
            InvitedAs::Member(_) => {
                Offer::Member(team.map(|name| name.to_string()).unwrap_or_default())
            }
            InvitedAs::Founder => Offer::Founder,
            InvitedAs::Return(_) => Offer::Return,
        },
        Code::Waiting(registration) => Offer::Waiting(registration.team_name.to_string()),
        Code::Refused(registration) => {
            let reason = match registration.state {
                RegistrationState::Refused { reason, .. } => reason,
                RegistrationState::Waiting | RegistrationState::Approved { .. } => String::new(),
            };
            Offer::Refused(registration.team_name.to_string(), reason)
        }
    };
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let season = SeasonHead::now(app).await?.name;
    render(&Page {
        frame: Frame::of(app, season, "/join"),
        offer,
        terms: terms.into_iter().next().map(announcement::terms),
        divisions: app.store.divisions().await.map_err(Problem::from)?,
        form: Form {
            password: String::new(),
            ..form
        },
        least_chars: faceoff_service::passwords::MIN_CHARS,
        refused,
    })
}

pub(super) async fn page(
    State(app): State<App>,
    PathParam(code): PathParam<String>,
) -> Result<Response, PageProblem> {
    page_with(&app, &code, Form::default(), None).await
}

/// Joins and leads to the account, or says on the same page what is missing.
pub(super) async fn submit(
    State(app): State<App>,
    PathParam(code): PathParam<String>,
    PageForm(form): PageForm<Form>,
) -> Result<Response, PageProblem> {
    match joined(&app, &code, &form).await {
        Ok(response) => Ok(response),
        // What the page itself tells of a code, or is nobody's mistake, is no remark beside the form.
        Err(PageProblem(problem)) if problem.kind() == ProblemKind::InvitationSpent => {
            Err(problem.into())
        }
        Err(PageProblem(problem)) if problem.kind().status().is_client_error() => {
            let status = problem.kind().status();
            let refused = Some(problem.detail().to_owned());
            let page = page_with(&app, &code, form, refused).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem),
    }
}

async fn joined(app: &App, code: &str, form: &Form) -> Result<Response, PageProblem> {
    let name = filled(&form.name).map(|name| name.parse()).transpose();
    let request = Join {
        code: code.to_owned(),
        name: name.map_err(|error| Problem::invalid("name", error))?,
        password: (!form.password.is_empty()).then(|| form.password.clone()),
        team: founded(
            &form.team_name,
            &form.affiliation,
            &form.link,
            &form.division,
        )?,
        accepted_terms: accepted(&form.accepted_terms)?,
    };
    let until = session_end(app.config.clock.now());
    let (_, secret) = join(app, request, TokenKind::Session, Some(until)).await?;
    signed_in(app, secret.as_str())
}

//! `/sign-in` and `/sign-out`: starting and ending a browser session.

use super::{
    format,
    frame::{Frame, PageProblem, render},
    kept_form::{self, KeptForm},
    page_auth::return_path,
    signed_in::with_user,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    http::{HeaderMap, Uri, header},
    response::{AppendHeaders, IntoResponse, Redirect, Response},
};
use faceoff_service::{
    app::App,
    auth::{self, Caller},
    extract::PageForm,
    network::ClientNetwork,
    problem::ProblemKind,
    services::sessions::{self, sign_in},
    session,
};
use serde::Deserialize;

/// Default target after signing in. It redirects organisers to their dashboard.
const DASHBOARD: &str = "/dashboard";

#[derive(Template)]
#[template(path = "sign_in.html")]
struct Page {
    frame: Frame,
    name: String,
    error: Option<String>,
    /// Path to return to; empty: the dashboard.
    return_path: String,
    /// A form that was submitted after the session had expired.
    kept: Option<KeptForm>,
}

/// The fields of the form.
struct Form {
    name: String,
    password: String,
    /// Path to return to.
    next: String,
    kept: Option<KeptForm>,
}

impl From<Vec<(String, String)>> for Form {
    fn from(fields: Vec<(String, String)>) -> Self {
        let text = |name: &str| {
            let mut fields = fields.iter();
            let field = fields.find(|(field, _)| field == name);
            field.map(|(_, text)| text.clone()).unwrap_or_default()
        };
        Self {
            name: text("name"),
            password: text("password"),
            next: text("next"),
            kept: KeptForm::from_sign_in_fields(&fields),
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct NextQuery {
    /// Path to return to.
    next: String,
}

fn valid_return_path(path: &str) -> String {
    return_path(path).unwrap_or_default().to_owned()
}

async fn page_with(
    app: &App,
    name: String,
    error: Option<String>,
    return_path: String,
    kept: Option<KeptForm>,
) -> Result<Response, PageProblem> {
    render(&Page {
        frame: Frame::load(app, "/sign-in").await?,
        name,
        error,
        return_path,
        kept,
    })
}

/// The page for a form that was submitted after the session had expired.
pub(super) async fn page_with_form(app: &App, kept: KeptForm) -> Result<Response, PageProblem> {
    page_with(app, String::new(), None, String::new(), Some(kept)).await
}

pub(super) async fn page(
    State(app): State<App>,
    Query(NextQuery { next }): Query<NextQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, String::new(), None, valid_return_path(&next), None).await
}

/// Signs in and redirects to the requested page or the dashboard; shows an error on the same page.
pub(super) async fn submit(
    State(app): State<App>,
    ClientNetwork(client): ClientNetwork,
    uri: Uri,
    headers: HeaderMap,
    PageForm(fields): PageForm<Vec<(String, String)>>,
) -> Result<Response, PageProblem> {
    let form = Form::from(fields);
    let signed_in = match session::check_cookie_is_kept(&app.config, &headers, uri.path()) {
        Ok(()) => sign_in(&app, &form.name, form.password, client).await,
        Err(problem) => Err(problem),
    };
    match signed_in {
        Ok((_, secret)) if let Some(kept) = form.kept => {
            let cookie = session::set_cookie(&app.config, Some(secret.as_str()))?;
            let caller = auth::caller_with_session(&app, secret.as_str()).await?;
            let page = kept_form::page(&app, kept);
            let page = with_user(&app, caller.as_ref(), page).await?;
            Ok((AppendHeaders([(header::SET_COOKIE, cookie)]), page).into_response())
        }
        Ok((_, secret)) => {
            let target = return_path(&form.next).unwrap_or(DASHBOARD);
            redirect_with_session(&app, secret.as_str(), target)
        }
        Err(problem)
            if matches!(
                problem.kind(),
                ProblemKind::Unauthenticated | ProblemKind::TooManySignIns | ProblemKind::Forbidden
            ) =>
        {
            let status = problem.kind().status();
            let error = Some(format::sentence(problem.detail()));
            let return_path = valid_return_path(&form.next);
            let page = page_with(&app, form.name, error, return_path, form.kept).await?;
            Ok((status, page).into_response())
        }
        Err(problem) => Err(problem.into()),
    }
}

/// Redirects to the dashboard with the cookie of a new session.
pub(super) fn redirect_to_dashboard(app: &App, secret: &str) -> Result<Response, PageProblem> {
    redirect_with_session(app, secret, DASHBOARD)
}

fn redirect_with_session(app: &App, secret: &str, path: &str) -> Result<Response, PageProblem> {
    let cookie = session::set_cookie(&app.config, Some(secret))?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to(path)).into_response())
}

/// Ends the session and redirects to the board.
pub(super) async fn sign_out(
    caller: Caller,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    sessions::end(&app, &caller).await?;
    let cookie = session::set_cookie(&app.config, None)?;
    let cookie = AppendHeaders([(header::SET_COOKIE, cookie)]);
    Ok((cookie, Redirect::to("/")).into_response())
}

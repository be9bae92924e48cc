//! `/dashboard/settings` and `/organiser/settings`: the user's name and password; for members also how the team is called and described.

use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::{PageMember, PageUser},
};
use askama::Template;
use axum::{
    Router,
    extract::{Query, State},
    response::Response,
    routing::{get, post},
};
use faceoff_api::requests::{NewPassword, TeamChange};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::PageForm,
    network::ClientNetwork,
    passwords,
    problem::{Problem, ProblemKind},
    services::{teams, users},
};
use faceoff_types::UserId;
use serde::Deserialize;

/// The pages below `dashboard_path`, which is `/dashboard` or `/organiser`.
pub(crate) fn router(dashboard_path: &str) -> Router<App> {
    let path = |rest: &str| format!("{dashboard_path}/settings{rest}");
    Router::new()
        .route(&path(""), get(page))
        .route(&path("/name"), post(rename))
        .route(&path("/password"), post(set_password))
}

/// The form of a team, which organisers do not have.
pub(super) fn team_router() -> Router<App> {
    Router::new().route("/dashboard/settings/team", post(change_team))
}

/// Path of this page for the caller.
fn settings_path(caller: &Caller) -> &'static str {
    match caller.is_organiser() {
        true => "/organiser/settings",
        false => "/dashboard/settings",
    }
}

#[derive(Template)]
#[template(path = "dashboard_settings.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    /// Path of the page; the forms of name and password post to paths below it.
    path: &'static str,
    /// The user's name, as the form has it; `None` for a team's token.
    user_name: Option<String>,
    min_password_chars: usize,
    /// `None` for organisers.
    team: Option<TeamForm>,
}

/// The team, as the form has it.
#[derive(Deserialize)]
struct TeamForm {
    team_name: String,
    affiliation: String,
    link: String,
}

/// What was typed into a form that was refused.
enum RefusedForm {
    UserName(String),
    Team(TeamForm),
}

async fn page_with(
    app: &App,
    caller: &Caller,
    notice: Notice<'_>,
    refused: Option<RefusedForm>,
) -> Result<Response, PageProblem> {
    let path = settings_path(caller);
    let current = caller.team().map(|team| TeamForm {
        team_name: team.name.to_string(),
        affiliation: team.profile.affiliation.clone().unwrap_or_default(),
        link: team.profile.link.clone().unwrap_or_default(),
    });
    let mut page = Page {
        frame: Frame::load(app, path).await?,
        head: DashboardHeader::new(caller, path, notice),
        path,
        user_name: caller.user().map(|user| user.name.to_string()),
        min_password_chars: passwords::MIN_CHARS,
        team: current,
    };
    match refused {
        Some(RefusedForm::UserName(name)) => page.user_name = Some(name),
        Some(RefusedForm::Team(form)) => page.team = Some(form),
        None => {}
    }
    render_dashboard(&page, notice)
}

async fn page(
    PageUser(caller): PageUser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &caller, Notice::Done(&notice), None).await
}

/// The calling user. A token of a team or of the operator belongs to no user.
fn calling_user(caller: &Caller) -> Result<UserId, Problem> {
    match caller.user() {
        Some(user) => Ok(user.id),
        None => Err(Problem::new(
            ProblemKind::Forbidden,
            "this token belongs to no user; sign in with your name",
        )),
    }
}

#[derive(Deserialize)]
struct UserForm {
    user_name: String,
}

/// Changes the user's own name.
async fn rename(
    PageUser(caller): PageUser,
    State(app): State<App>,
    form: Result<PageForm<UserForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(UserForm { user_name }) = form?;
    let user = calling_user(&caller)?;
    let renamed = match user_name.trim().parse() {
        Ok(name) => users::rename_user(&app, &caller, user, name).await,
        Err(error) => Err(Problem::invalid("your name", error)),
    };
    match renamed {
        Ok(_) => Ok(redirect_done(settings_path(&caller), "user-renamed")),
        Err(problem) => {
            let refused = Some(RefusedForm::UserName(user_name));
            page_with(&app, &caller, Notice::Refused(&problem), refused).await
        }
    }
}

#[derive(Deserialize)]
struct PasswordForm {
    old_password: String,
    new_password: String,
}

/// Sets the user's own password.
async fn set_password(
    PageUser(caller): PageUser,
    State(app): State<App>,
    ClientNetwork(client): ClientNetwork,
    form: Result<PageForm<PasswordForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let user = calling_user(&caller)?;
    let request = NewPassword {
        old: Some(form.old_password),
        password: form.new_password,
    };
    match users::set_password(&app, &caller, user, request, client).await {
        Ok(_) => Ok(redirect_done(settings_path(&caller), "password-set")),
        Err(problem) => page_with(&app, &caller, Notice::Refused(&problem), None).await,
    }
}

fn team_change(form: &TeamForm) -> Result<TeamChange, Problem> {
    let non_empty = |text: &str| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
    let name = form.team_name.trim().parse();
    Ok(TeamChange {
        name: Some(name.map_err(|error| Problem::invalid("the team's name", error))?),
        affiliation: Some(non_empty(&form.affiliation)),
        link: Some(non_empty(&form.link)),
        ..TeamChange::default()
    })
}

/// Renames the team and changes its public description.
async fn change_team(
    member: PageMember,
    State(app): State<App>,
    form: Result<PageForm<TeamForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let changed = match team_change(&form) {
        Ok(change) => teams::change_team(&app, &member.caller, member.team.team.id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(redirect_done(settings_path(&member.caller), "team-changed")),
        Err(problem) => {
            let notice = Notice::Refused(&problem);
            page_with(&app, &member.caller, notice, Some(RefusedForm::Team(form))).await
        }
    }
}

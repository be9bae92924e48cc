//! `/dashboard/questions`: questions of the team, and published answers.

use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageMember,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::{requests::NewQuestion, views::announcement::QuestionView};
use faceoff_service::{app::App, extract::PageForm, problem::Problem, services::announcements};

const PATH: &str = "/dashboard/questions";

#[derive(Template)]
#[template(path = "dashboard_questions.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    questions: Vec<QuestionView>,
    text: String,
}

async fn page_with(
    app: &App,
    member: &PageMember,
    notice: Notice<'_>,
    text: String,
) -> Result<Response, PageProblem> {
    let page = Page {
        frame: Frame::load(app, PATH).await?,
        head: DashboardHeader::new(&member.caller, PATH, notice),
        questions: announcements::questions(app, Some(&member.caller)).await?,
        text,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    member: PageMember,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &member, Notice::Done(&notice), String::new()).await
}

pub(super) async fn ask(
    member: PageMember,
    State(app): State<App>,
    form: Result<PageForm<NewQuestion>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let team = member.team.team.id;
    // A form that is sent twice asks only once.
    let asked = match announcements::is_open_question(&app, team, &form).await {
        Ok(false) => announcements::ask(&app, &member.team, &form)
            .await
            .map(drop),
        Ok(true) => Ok(()),
        Err(problem) => Err(problem),
    };
    match asked {
        Ok(()) => Ok(redirect_done(PATH, "asked")),
        Err(problem) => page_with(&app, &member, Notice::Refused(&problem), form.text).await,
    }
}

//! `/desk/questions`: what the team asks the organisers, and what they answered, to it or to everybody.

use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    figures::minute,
    frame::{Frame, PageProblem},
    signed_in::Member,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::{requests::NewQuestion, views::announcement::QuestionView};
use faceoff_service::{
    acts::telling, app::App, extract::PageForm, problem::Problem, views::season::SeasonHead,
};

const PATH: &str = "/desk/questions";

#[derive(Template)]
#[template(path = "desk_questions.html")]
struct Page {
    frame: Frame,
    head: Head,
    questions: Vec<QuestionView>,
    text: String,
}

impl Page {
    fn at(&self, at: &jiff::Timestamp) -> String {
        minute(*at)
    }
}

async fn page_with(
    app: &App,
    member: &Member,
    said: Said<'_>,
    text: String,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, season, PATH),
        head: Head::of(&member.caller, PATH, said),
        questions: telling::questions(app, Some(&member.caller)).await?,
        text,
    };
    render_desk(&page, said)
}

pub(super) async fn page(
    member: Member,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &member, Said::Done(&said), String::new()).await
}

pub(super) async fn ask(
    member: Member,
    State(app): State<App>,
    form: Result<PageForm<NewQuestion>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    match telling::ask(&app, &member.team, &form).await {
        Ok(_) => Ok(done(PATH, "asked")),
        Err(problem) => page_with(&app, &member, Said::Refused(&problem), form.text).await,
    }
}

//! `/desk/questions`: what the team asks the organisers, and what they answered, to it or to everybody.

use crate::{
    acts::telling,
    app::App,
    extract::PageForm,
    pages::{
        desk_frame::{self, Done, Head, done, render_desk},
        frame::{Frame, PageProblem},
        signed_in::{Member, Refused},
    },
    problem::Problem,
    requests::NewQuestion,
    views::{announcement::QuestionView, season::SeasonHead},
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Response},
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
        desk_frame::at(*at)
    }
}

async fn page_with(
    app: &App,
    member: &Member,
    said: &Done,
    text: String,
    refused: Option<&Problem>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, season, PATH),
        head: Head::of(&member.caller, PATH, said).refusing(refused),
        questions: telling::questions(app, Some(&member.caller)).await?,
        text,
    };
    render_desk(&page, refused)
}

pub(super) async fn page(
    member: Result<Member, Refused>,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    match member {
        Ok(member) => page_with(&app, &member, &said, String::new(), None).await,
        Err(refused) => Ok(refused.into_response()),
    }
}

/// Asks.
pub(super) async fn ask(
    member: Result<Member, Refused>,
    State(app): State<App>,
    form: Result<PageForm<NewQuestion>, Problem>,
) -> Result<Response, PageProblem> {
    let member = match member {
        Ok(member) => member,
        Err(refused) => return Ok(refused.into_response()),
    };
    let PageForm(form) = form?;
    match telling::ask(&app, &member.team, &form).await {
        Ok(_) => Ok(done(PATH, "asked")),
        Err(problem) => {
            let said = Done::default();
            page_with(&app, &member, &said, form.text, Some(&problem)).await
        }
    }
}

//! `/announcements`: announcements of the organisers, published answers and the terms.

use super::frame::{Frame, PageProblem, render};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::announcement::{AnnouncementView, QuestionView, TermsView};
use faceoff_service::{app::App, views::announcement};

/// Largest number of announcements on the page.
const MAX_ANNOUNCEMENTS: u32 = 200;

#[derive(Template)]
#[template(path = "announcements.html")]
struct Page {
    frame: Frame,
    announcements: Vec<AnnouncementView>,
    answered: Vec<QuestionView>,
    terms: Option<TermsView>,
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let announcements = app.store.announcements(MAX_ANNOUNCEMENTS).await;
    let questions = app.store.questions().await?;
    let public = questions.into_iter().filter(|question| {
        let answer = question.answer.as_ref();
        answer.is_some_and(|answer| answer.is_public)
    });
    let terms = app.store.terms().await?;
    render(&Page {
        frame: Frame::load(&app, "/announcements").await?,
        announcements: announcements?.into_iter().map(announcement::view).collect(),
        answered: public
            .map(|question| announcement::question(question, false))
            .collect(),
        terms: terms.into_iter().next().map(announcement::terms),
    })
}

//! `/announcements`: what the organisers have told everybody, and what they have answered for everybody to read.

use super::{
    figures::minute,
    frame::{Frame, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::announcement::{AnnouncementView, QuestionView, TermsView};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{announcement, season::SeasonHead},
};
use jiff::Timestamp;

/// Announcements that the page shows.
const SHOWN: u32 = 200;

#[derive(Template)]
#[template(path = "announcements.html")]
struct Page {
    frame: Frame,
    announcements: Vec<AnnouncementView>,
    answered: Vec<QuestionView>,
    terms: Option<TermsView>,
}

impl Page {
    fn shown(&self, at: &Timestamp) -> String {
        minute(*at)
    }
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let announcements = app.store.announcements(SHOWN).await;
    let questions = app.store.questions().await.map_err(Problem::from)?;
    let public = questions.into_iter().filter(|question| {
        let answer = question.answer.as_ref();
        answer.is_some_and(|answer| answer.is_public)
    });
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let season = SeasonHead::now(&app).await?.name;
    render(&Page {
        frame: Frame::of(&app, season, "/announcements"),
        announcements: announcements
            .map_err(Problem::from)?
            .into_iter()
            .map(announcement::of)
            .collect(),
        answered: public
            .map(|question| announcement::question(question, false))
            .collect(),
        terms: terms.into_iter().next().map(announcement::terms),
    })
}

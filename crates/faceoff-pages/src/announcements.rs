//! `/announcements`: announcements of the organisers, published answers and the terms.

use super::{
    figures::utc_minute,
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

impl Page {
    fn timestamp(&self, instant: &Timestamp) -> String {
        utc_minute(*instant)
    }
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let announcements = app.store.announcements(MAX_ANNOUNCEMENTS).await;
    let questions = app.store.questions().await.map_err(Problem::from)?;
    let public = questions.into_iter().filter(|question| {
        let answer = question.answer.as_ref();
        answer.is_some_and(|answer| answer.is_public)
    });
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let season = SeasonHead::load(&app).await?.name;
    render(&Page {
        frame: Frame::for_app(&app, season, "/announcements"),
        announcements: announcements
            .map_err(Problem::from)?
            .into_iter()
            .map(announcement::view)
            .collect(),
        answered: public
            .map(|question| announcement::question(question, false))
            .collect(),
        terms: terms.into_iter().next().map(announcement::terms),
    })
}

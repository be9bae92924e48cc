//! `/organiser/messages`: questions to answer, announcements, and the terms.

use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    figures::minute,
    frame::{Frame, PageProblem},
    signed_in::Organising,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::{
    requests::{NewAnnouncement, NewAnswer, NewTerms},
    views::announcement::{AnnouncementView, QuestionView, TermsView},
};
use faceoff_service::{
    acts::telling,
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    views::{announcement, event, season::SeasonHead},
};
use faceoff_types::QuestionId;
use serde::Deserialize;
use std::collections::BTreeMap;

const PATH: &str = "/organiser/messages";
/// Announcements that are listed.
const SHOWN: u32 = 20;

#[derive(Template)]
#[template(path = "organiser_messages.html")]
struct Page {
    frame: Frame,
    head: Head,
    open: Vec<QuestionView>,
    answered: Vec<QuestionView>,
    announcements: Vec<AnnouncementView>,
    terms: Option<TermsView>,
    names: BTreeMap<String, String>,
    typed: Typed,
}

/// What was typed into the form that was refused.
#[derive(Default)]
struct Typed {
    title: String,
    text: String,
    terms: String,
    answer: Option<(QuestionId, String)>,
}

impl Page {
    fn at(&self, at: &jiff::Timestamp) -> String {
        minute(*at)
    }

    fn team(&self, question: &QuestionView) -> &str {
        let team = question.team.map(|team| format!("team:{team}"));
        let name = team.and_then(|key| self.names.get(&key));
        name.map_or("a team", String::as_str)
    }

    fn answer<'a>(&'a self, question: &'a QuestionView) -> &'a str {
        match &self.typed.answer {
            Some((id, text)) if *id == question.id => text,
            _ => question.answer.as_deref().unwrap_or_default(),
        }
    }
}

async fn page_with(
    app: &App,
    organising: &Organising,
    said: Said<'_>,
    typed: Typed,
) -> Result<Response, PageProblem> {
    let all = telling::questions(app, Some(&organising.caller)).await?;
    let (open, answered) = all.into_iter().partition(|one| one.answer.is_none());
    let announcements = app.store.announcements(SHOWN).await;
    let announcements = announcements.map_err(Problem::from)?.into_iter();
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let season = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, season, PATH),
        head: Head::of(&organising.caller, PATH, said),
        open,
        answered,
        announcements: announcements.map(announcement::of).collect(),
        terms: terms.into_iter().next().map(announcement::terms),
        names: event::names(app).await?,
        typed,
    };
    render_desk(&page, said)
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &organising, Said::Done(&said), Typed::default()).await
}

pub(super) async fn announce(
    organising: Organising,
    State(app): State<App>,
    form: Result<PageForm<NewAnnouncement>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    match telling::announce(&app, organising.organiser.actor(), &form).await {
        Ok(_) => Ok(done(PATH, "announced")),
        Err(problem) => {
            let typed = Typed {
                title: form.title,
                text: form.text,
                ..Typed::default()
            };
            page_with(&app, &organising, Said::Refused(&problem), typed).await
        }
    }
}

#[derive(Deserialize)]
pub(super) struct AnswerForm {
    text: String,
    /// Ticked, or not sent.
    #[serde(default)]
    public: String,
}

pub(super) async fn answer(
    organising: Organising,
    State(app): State<App>,
    id: Result<PathParam<QuestionId>, Problem>,
    form: Result<PageForm<AnswerForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let new = NewAnswer {
        text: form.text,
        public: !form.public.is_empty(),
    };
    match telling::answer(&app, organising.organiser.actor(), id, &new).await {
        Ok(_) => Ok(done(PATH, "answered")),
        Err(problem) => {
            let typed = Typed {
                answer: Some((id, new.text)),
                ..Typed::default()
            };
            page_with(&app, &organising, Said::Refused(&problem), typed).await
        }
    }
}

/// Publishes other terms.
pub(super) async fn publish_terms(
    organising: Organising,
    State(app): State<App>,
    form: Result<PageForm<NewTerms>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    match telling::publish_terms(&app, organising.organiser.actor(), &form).await {
        Ok(_) => Ok(done(PATH, "published")),
        Err(problem) => {
            let typed = Typed {
                terms: form.text,
                ..Typed::default()
            };
            page_with(&app, &organising, Said::Refused(&problem), typed).await
        }
    }
}

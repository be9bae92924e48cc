//! `/organiser/messages`: questions of teams, announcements and terms.

use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageOrganiser,
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
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    services::announcements,
    views::{announcement, event},
};
use faceoff_types::QuestionId;
use serde::Deserialize;
use std::collections::BTreeMap;

const PATH: &str = "/organiser/messages";
/// Number of announcements in the list.
const LISTED_ANNOUNCEMENTS: u32 = 20;

#[derive(Template)]
#[template(path = "organiser_messages.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    open: Vec<QuestionView>,
    answered: Vec<QuestionView>,
    announcements: Vec<AnnouncementView>,
    terms: Option<TermsView>,
    names: BTreeMap<String, String>,
    form: FormValues,
}

/// Values of a refused form, to be shown again.
#[derive(Default)]
struct FormValues {
    title: String,
    text: String,
    terms: String,
    answer: Option<(QuestionId, String)>,
}

impl Page {
    fn team(&self, question: &QuestionView) -> &str {
        let team = question.team.map(|team| format!("team:{team}"));
        let name = team.and_then(|key| self.names.get(&key));
        name.map_or("a team", String::as_str)
    }

    fn answer<'a>(&'a self, question: &'a QuestionView) -> &'a str {
        match &self.form.answer {
            Some((id, text)) if *id == question.id => text,
            _ => question.answer.as_deref().unwrap_or_default(),
        }
    }
}

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    notice: Notice<'_>,
    values: FormValues,
) -> Result<Response, PageProblem> {
    let all = announcements::questions(app, Some(&user.caller)).await?;
    let (open, answered) = all
        .into_iter()
        .partition(|question| question.answer.is_none());
    let announcements = app.store.announcements(LISTED_ANNOUNCEMENTS).await;
    let announcements = announcements?.into_iter();
    let terms = app.store.terms().await?;
    let page = Page {
        frame: Frame::load(app, PATH).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        open,
        answered,
        announcements: announcements.map(announcement::view).collect(),
        terms: terms.into_iter().next().map(announcement::terms),
        names: event::actor_names(app).await?,
        form: values,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &user, Notice::Done(&notice), FormValues::default()).await
}

pub(super) async fn announce(
    user: PageOrganiser,
    State(app): State<App>,
    form: Result<PageForm<NewAnnouncement>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let announced = match announcements::is_newest(&app, &form).await {
        Ok(false) => announcements::announce(&app, user.organiser.actor(), &form)
            .await
            .map(drop),
        Ok(true) => Ok(()),
        Err(problem) => Err(problem),
    };
    match announced {
        Ok(()) => Ok(redirect_done(PATH, "announced")),
        Err(problem) => {
            let values = FormValues {
                title: form.title,
                text: form.text,
                ..FormValues::default()
            };
            page_with(&app, &user, Notice::Refused(&problem), values).await
        }
    }
}

#[derive(Deserialize)]
pub(super) struct AnswerForm {
    text: String,
    /// Checkbox: not sent if it is not ticked.
    #[serde(default)]
    public: String,
}

pub(super) async fn answer(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<QuestionId>, Problem>,
    form: Result<PageForm<AnswerForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let new = NewAnswer {
        text: form.text,
        public: !form.public.is_empty(),
    };
    match announcements::answer(&app, user.organiser.actor(), id, &new).await {
        Ok(_) => Ok(redirect_done(PATH, "answered")),
        Err(problem) => {
            let values = FormValues {
                answer: Some((id, new.text)),
                ..FormValues::default()
            };
            page_with(&app, &user, Notice::Refused(&problem), values).await
        }
    }
}

/// Publishes other terms.
pub(super) async fn publish_terms(
    user: PageOrganiser,
    State(app): State<App>,
    form: Result<PageForm<NewTerms>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    match announcements::publish_terms(&app, user.organiser.actor(), &form).await {
        Ok(_) => Ok(redirect_done(PATH, "published")),
        Err(problem) => {
            let values = FormValues {
                terms: form.text,
                ..FormValues::default()
            };
            page_with(&app, &user, Notice::Refused(&problem), values).await
        }
    }
}

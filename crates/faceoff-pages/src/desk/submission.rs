//! `/desk/submissions/{id}`: a submission's verdict, its log, and what becomes of it.

use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    entry::Entry,
    frame::{Frame, PageProblem},
    signed_in::Member,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::{
    requests::SubmissionChange,
    views::submission::{SubmissionStatus, SubmissionView},
};
use faceoff_service::{
    acts::entering_days,
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    views::{season::SeasonHead, submission},
};
use faceoff_types::{SmokeTiming, SubmissionId};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "desk_submission.html")]
struct Page {
    frame: Frame,
    head: Head,
    entry: Entry,
    view: SubmissionView,
    log: Option<String>,
    timing: Vec<Timing>,
    label: String,
    note: String,
    is_validating: bool,
}

/// How long the answers took in a task of the smoke run.
struct Timing {
    task: String,
    steps: u32,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
    points: String,
}

impl From<&SmokeTiming> for Timing {
    fn from(timing: &SmokeTiming) -> Self {
        let ms = |seconds: f64| format!("{:.2}", 1000.0 * seconds);
        Self {
            task: timing.task.to_string(),
            steps: timing.steps,
            mean_ms: ms(timing.mean_s),
            p99_ms: ms(timing.p99_s),
            max_ms: ms(timing.max_s),
            points: format!("{:.1}", timing.points_per_episode),
        }
    }
}

fn path(id: SubmissionId) -> String {
    format!("/desk/submissions/{id}")
}

async fn page_with(
    app: &App,
    member: &Member,
    id: SubmissionId,
    said: Said<'_>,
    filled: Option<Words>,
) -> Result<Response, PageProblem> {
    let found = app.store.submission(id).await;
    let submission = member
        .caller
        .visible("submission", found, |submission| submission.team)?;
    let view = submission::of(app, submission).await?;
    let season = SeasonHead::now(app).await?.name;
    let log = match &view.status {
        SubmissionStatus::Valid { log } | SubmissionStatus::Invalid { log, .. } => log.clone(),
        SubmissionStatus::Validating | SubmissionStatus::ValidationError { .. } => None,
    };
    let words = filled.unwrap_or_else(|| Words {
        label: view.label.clone().unwrap_or_default(),
        note: view.note.clone().unwrap_or_default(),
    });
    let page = Page {
        frame: Frame::of(app, season, ""),
        head: Head::of(&member.caller, "", said),
        entry: Entry::from(&view),
        log: log.filter(|log| !log.trim().is_empty()),
        timing: view.timing.iter().map(Timing::from).collect(),
        label: words.label,
        note: words.note,
        is_validating: view.status == SubmissionStatus::Validating,
        view,
    };
    render_desk(&page, said)
}

/// A submission of the team's.
pub(super) async fn page(
    member: Member,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &member, id?.0, Said::Done(&said), None).await
}

#[derive(Deserialize)]
pub(super) struct Nothing {}

/// Has it play at the next cut.
pub(super) async fn activate(
    member: Member,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<Nothing>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(Nothing {})) = (id?, form?);
    match entering_days::activate_submission(&app, &member.team, id).await {
        Ok(_) => Ok(done("/desk", "activated")),
        Err(problem) => page_with(&app, &member, id, Said::Refused(&problem), None).await,
    }
}

pub(super) async fn withdraw(
    member: Member,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<Nothing>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(Nothing {})) = (id?, form?);
    match entering_days::withdraw_submission(&app, &member.team, id).await {
        Ok(_) => Ok(done("/desk", "withdrawn")),
        Err(problem) => page_with(&app, &member, id, Said::Refused(&problem), None).await,
    }
}

/// What the team says of a submission.
#[derive(Deserialize)]
pub(super) struct Words {
    label: String,
    note: String,
}

pub(super) async fn describe(
    member: Member,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<Words>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(words)) = (id?, form?);
    let said = |text: &str| Some(Some(text.trim().to_owned()).filter(|text| !text.is_empty()));
    let change = SubmissionChange {
        label: said(&words.label),
        note: said(&words.note.replace("\r\n", "\n")),
    };
    match entering_days::describe_submission(&app, &member.team, id, &change).await {
        Ok(_) => Ok(done(&path(id), "described")),
        Err(problem) => {
            let filled = Some(words);
            page_with(&app, &member, id, Said::Refused(&problem), filled).await
        }
    }
}

//! `/dashboard/submissions/{id}`: validation result, log and actions of a submission.

use crate::{
    dashboard_frame::{
        DashboardHeader, DoneQuery, EmptyForm, Notice, redirect_done, render_dashboard,
    },
    frame::{Frame, NO_ENTRY, PageProblem},
    page_auth::PageMember,
    submission_row::SubmissionRow,
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
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    services::submissions,
    views::submission,
};
use faceoff_types::{Competition, SubmissionId, ValidationTiming};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "dashboard_submission.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    submission: SubmissionRow,
    view: SubmissionView,
    log: Option<String>,
    timing: Vec<TimingRow>,
    label: String,
    note: String,
    is_validating: bool,
}

/// Answer times in a task of the validation run.
struct TimingRow {
    task: String,
    steps: u32,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
    /// Penalty points per episode.
    points: String,
    violations: String,
}

impl TimingRow {
    fn new(timing: &ValidationTiming, competition: &Competition) -> Self {
        let ms = |seconds: f64| format!("{:.2}", 1000.0 * seconds);
        Self {
            task: timing.task.to_string(),
            steps: timing.steps,
            mean_ms: ms(timing.mean_s),
            p99_ms: ms(timing.p99_s),
            max_ms: ms(timing.max_s),
            points: format!("{:.1}", timing.points_per_episode),
            violations: violations_text(timing, competition),
        }
    }
}

/// The violated limits, such as “joint position in 3 of 4 episodes”; empty if the validation run did not record them.
fn violations_text(timing: &ValidationTiming, competition: &Competition) -> String {
    if timing.episodes > 0 && timing.violations.is_empty() {
        return "none".to_owned();
    }
    let limits = timing.violations.iter().map(|violated| {
        let info = competition.violation(violated.limit);
        let name = info.map_or(violated.limit.as_str(), |info| info.column_heading.as_str());
        format!(
            "{name} in {} of {} episodes",
            violated.episodes, timing.episodes
        )
    });
    limits.collect::<Vec<_>>().join(", ")
}

fn path(id: SubmissionId) -> String {
    format!("/dashboard/submissions/{id}")
}

async fn page_with(
    app: &App,
    member: &PageMember,
    id: SubmissionId,
    notice: Notice<'_>,
    form: Option<DescriptionForm>,
) -> Result<Response, PageProblem> {
    let stored = app.store.submission(id).await;
    let submission = member
        .caller
        .visible("submission", stored, |submission| submission.team)?;
    let view = submission::build(app, submission).await?;
    let log = match &view.status {
        SubmissionStatus::Valid { log } | SubmissionStatus::Invalid { log, .. } => log.clone(),
        SubmissionStatus::Validating | SubmissionStatus::PlatformFailed { .. } => None,
    };
    let form = form.unwrap_or_else(|| DescriptionForm {
        label: view.label.clone().unwrap_or_default(),
        note: view.note.clone().unwrap_or_default(),
    });
    let page = Page {
        frame: Frame::load(app, NO_ENTRY).await?,
        head: DashboardHeader::new(&member.caller, NO_ENTRY, notice),
        submission: SubmissionRow::from(&view),
        log: log.filter(|log| !log.trim().is_empty()),
        timing: view
            .timing
            .iter()
            .map(|timing| TimingRow::new(timing, app.config.competition()))
            .collect(),
        label: form.label,
        note: form.note,
        is_validating: view.status == SubmissionStatus::Validating,
        view,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    member: PageMember,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &member, id?.0, Notice::Done(&notice), None).await
}

/// Makes it the active submission.
pub(super) async fn activate(
    member: PageMember,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<EmptyForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(EmptyForm {})) = (id?, form?);
    match submissions::activate_submission(&app, &member.team, id).await {
        Ok(_) => Ok(redirect_done("/dashboard", "activated")),
        Err(problem) => page_with(&app, &member, id, Notice::Refused(&problem), None).await,
    }
}

pub(super) async fn withdraw(
    member: PageMember,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<EmptyForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(EmptyForm {})) = (id?, form?);
    match submissions::withdraw_submission(&app, &member.team, id).await {
        Ok(_) => Ok(redirect_done("/dashboard", "withdrawn")),
        Err(problem) => page_with(&app, &member, id, Notice::Refused(&problem), None).await,
    }
}

#[derive(Deserialize)]
pub(super) struct DescriptionForm {
    label: String,
    note: String,
}

pub(super) async fn describe(
    member: PageMember,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
    form: Result<PageForm<DescriptionForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    // The outer `Some` changes the field, an inner `None` removes its value.
    let change_to = |text: &str| Some(Some(text.trim().to_owned()).filter(|text| !text.is_empty()));
    let change = SubmissionChange {
        label: change_to(&form.label),
        note: change_to(&form.note.replace("\r\n", "\n")),
    };
    match submissions::describe_submission(&app, &member.team, id, &change).await {
        Ok(_) => Ok(redirect_done(&path(id), "described")),
        Err(problem) => page_with(&app, &member, id, Notice::Refused(&problem), Some(form)).await,
    }
}

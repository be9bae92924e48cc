//! `/organiser/stages/{id}`: status, settings and decisions of a stage.

use super::stage_form::{InputKind, StageForm};
use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, NO_ENTRY, PageProblem},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::stage::{PhaseView, StageView};
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    problem::{Problem, ProblemKind},
    services::stages,
    viewer::Viewer,
    views::stage,
};
use faceoff_types::{CountingResult, ProfileInfo, StageId};

#[derive(Template)]
#[template(path = "organiser_stage.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    stage: StageView,
    form: StageForm,
    /// Names of the tasks' checkboxes, and titles of the tasks.
    task_checkboxes: Vec<(String, String)>,
    /// All profiles of the competition.
    profiles: Vec<ProfileInfo>,
    /// The name that confirms a change with consequences; the refusal lists them.
    confirm: Option<String>,
    is_closed: bool,
    has_final_day: bool,
    /// Does the competition have tiers?
    has_tiers: bool,
}

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    id: StageId,
    notice: Notice<'_>,
    form: Option<StageForm>,
) -> Result<Response, PageProblem> {
    let stage = app.store.stage(id).await?;
    let form = form.unwrap_or_else(|| StageForm::from_stage(&stage));
    let view = stage::build(app, stage).await?;
    let view = stage::for_viewer(view, app, Viewer::Organiser).await?;
    let needs_confirmation =
        matches!(notice, Notice::Refused(problem) if problem.kind() == ProblemKind::NotConfirmed);
    let page = Page {
        frame: Frame::load(app, NO_ENTRY).await?,
        head: DashboardHeader::new(&user.caller, "/organiser/stages", notice),
        form,
        task_checkboxes: StageForm::task_checkboxes(app.config.competition()),
        profiles: app.config.competition().profiles.clone(),
        confirm: needs_confirmation.then(|| view.name.to_string()),
        is_closed: view.phase == PhaseView::Closed,
        has_final_day: view.settings.counting_result == CountingResult::Final,
        has_tiers: app.config.competition().tiers.is_some(),
        stage: view,
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &user, id?.0, Notice::Done(&notice), None).await
}

/// Changes the stage, or shows on the same page an error or the effects to confirm.
pub(super) async fn change(
    user: PageOrganiser,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let stage = app.store.stage(id).await?;
    let actor = user.organiser.actor();
    let changed = match form.change(&stage, app.config.competition()) {
        Ok(change) => stages::change_stage(&app, actor, id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(redirect_done(
            &format!("/organiser/stages/{id}"),
            "stage-changed",
        )),
        Err(problem) => page_with(&app, &user, id, Notice::Refused(&problem), Some(form)).await,
    }
}

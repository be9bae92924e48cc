//! `/organiser/stages`: the stages of the season, and a form for a new stage.

use super::stage_form::{InputKind, StageForm};
use crate::{
    board_status,
    dashboard_frame::{DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::stage::StageView;
use faceoff_service::{
    app::App, extract::PageForm, problem::Problem, services::stages, views::stage,
};
use faceoff_types::ProfileInfo;

#[derive(Template)]
#[template(path = "organiser_stages.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    stages: Vec<StageView>,
    form: StageForm,
    /// Names of the tasks' checkboxes, and titles of the tasks.
    task_checkboxes: Vec<(String, String)>,
    /// All profiles of the competition.
    profiles: Vec<ProfileInfo>,
    /// Always `None`: creating a stage needs no confirmation. `stage_fields.html` expects the field.
    confirm: Option<String>,
    /// Was a form refused? Then it is shown open.
    is_refused: bool,
}

impl Page {
    fn phase(&self, stage: &StageView) -> &'static str {
        board_status::phase_label(stage.phase, stage.sign_off.is_some())
    }
}

async fn render_page(
    app: &App,
    user: &PageOrganiser,
    notice: Notice<'_>,
    form: Option<StageForm>,
) -> Result<Response, PageProblem> {
    let path = "/organiser/stages";
    let form = match form {
        Some(form) => form,
        None => StageForm::defaults_from(&stage::current(app).await?),
    };
    let page = Page {
        frame: Frame::load(app, path).await?,
        head: DashboardHeader::new(&user.caller, path, notice),
        stages: stage::all(app).await?,
        form,
        task_checkboxes: StageForm::task_checkboxes(app.config.competition()),
        profiles: app.config.competition().profiles.clone(),
        confirm: None,
        is_refused: matches!(notice, Notice::Refused(_)),
    };
    render_dashboard(&page, notice)
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    render_page(&app, &user, Notice::Done(&notice), None).await
}

pub(super) async fn create(
    user: PageOrganiser,
    State(app): State<App>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let actor = user.organiser.actor();
    let created = match form.new_stage(app.config.competition()) {
        Ok(new) => stages::create_stage(&app, actor, new).await,
        Err(problem) => Err(problem),
    };
    match created {
        Ok(_) => Ok(redirect_done("/organiser/stages", "stage-made")),
        Err(problem) => render_page(&app, &user, Notice::Refused(&problem), Some(form)).await,
    }
}

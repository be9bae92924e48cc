//! `/organiser/stages/{id}`: a stage's state, its settings, and what can be decided about it.

use super::stage_form::StageForm;
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
use faceoff_api::views::stage::{PhaseView, StageView};
use faceoff_service::{
    acts::staging,
    app::App,
    extract::{PageForm, PathParam},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{season::SeasonHead, stage},
};
use faceoff_types::{Profile, StageId, Standings};

#[derive(Template)]
#[template(path = "organiser_stage.html")]
struct Page {
    frame: Frame,
    head: Head,
    stage: StageView,
    form: StageForm,
    profiles: [Profile; 7],
    /// The name that confirms what the refusal told.
    confirm: Option<String>,
    is_closed: bool,
    has_final_day: bool,
}

impl Page {
    fn at(&self, at: &jiff::Timestamp) -> String {
        minute(*at)
    }
}

async fn page_with(
    app: &App,
    organising: &Organising,
    id: StageId,
    said: Said<'_>,
    form: Option<StageForm>,
) -> Result<Response, PageProblem> {
    let stage = app.store.stage(id).await.map_err(Problem::from)?;
    let form = form.unwrap_or_else(|| StageForm::of(&stage));
    let season = SeasonHead::now(app).await?.name;
    let view = stage::of(app, stage).await?;
    let view = stage::seen_by(view, app, Viewer::Organiser).await?;
    let is_asked =
        matches!(said, Said::Refused(problem) if problem.kind() == ProblemKind::NotConfirmed);
    let page = Page {
        frame: Frame::of(app, season, ""),
        head: Head::of(&organising.caller, "/organiser/stages", said),
        form,
        profiles: Profile::ALL,
        confirm: is_asked.then(|| view.name.to_string()),
        is_closed: view.phase == PhaseView::Closed,
        has_final_day: view.settings.standings == Standings::Final,
        stage: view,
    };
    render_desk(&page, said)
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &organising, id?.0, Said::Done(&said), None).await
}

/// Changes the stage, or says on the same page why not, or what is to be confirmed.
pub(super) async fn change(
    organising: Organising,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let stage = app.store.stage(id).await.map_err(Problem::from)?;
    let actor = organising.organiser.actor();
    let changed = match form.change(&stage) {
        Ok(change) => staging::change_stage(&app, actor, id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(done(&format!("/organiser/stages/{id}"), "stage-changed")),
        Err(problem) => page_with(&app, &organising, id, Said::Refused(&problem), Some(form)).await,
    }
}

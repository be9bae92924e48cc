//! `/organiser/stages/{id}`: a stage's state, its settings, and what can be decided about it.

use super::stage_form::StageForm;
use crate::{
    acts::staging,
    app::App,
    extract::{PageForm, PathParam},
    pages::{
        desk_frame::{self, Done, Head, done, render_desk},
        frame::{Frame, PageProblem},
        signed_in::{Organising, Refused},
    },
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        season::SeasonHead,
        stage::{PhaseView, StageView},
    },
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Response},
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
        desk_frame::at(*at)
    }
}

async fn page_with(
    app: &App,
    organising: &Organising,
    id: StageId,
    said: &Done,
    form: Option<StageForm>,
    refused: Option<&Problem>,
) -> Result<Response, PageProblem> {
    let stage = app.store.stage(id).await.map_err(Problem::from)?;
    let form = form.unwrap_or_else(|| StageForm::of(&stage));
    let season = SeasonHead::now(app).await?.name;
    let view = StageView::of(app, stage).await?;
    let view = view.seen_by(app, Viewer::Organiser).await?;
    let is_asked = refused.is_some_and(|problem| problem.kind() == ProblemKind::NotConfirmed);
    let page = Page {
        frame: Frame::of(app, season, ""),
        head: Head::of(&organising.caller, "/organiser/stages", said).refusing(refused),
        form,
        profiles: Profile::ALL,
        confirm: is_asked.then(|| view.name.to_string()),
        is_closed: view.phase == PhaseView::Closed,
        has_final_day: view.settings.standings == Standings::Final,
        stage: view,
    };
    render_desk(&page, refused)
}

pub(super) async fn page(
    organising: Result<Organising, Refused>,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    match organising {
        Ok(organising) => page_with(&app, &organising, id?.0, &said, None, None).await,
        Err(refused) => Ok(refused.into_response()),
    }
}

/// Changes the stage, or says on the same page why not, or what is to be confirmed.
pub(super) async fn change(
    organising: Result<Organising, Refused>,
    State(app): State<App>,
    id: Result<PathParam<StageId>, Problem>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let organising = match organising {
        Ok(organising) => organising,
        Err(refused) => return Ok(refused.into_response()),
    };
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let stage = app.store.stage(id).await.map_err(Problem::from)?;
    let actor = organising.organiser.actor();
    let changed = match form.change(&stage) {
        Ok(change) => staging::change_stage(&app, actor, id, change).await,
        Err(problem) => Err(problem),
    };
    match changed {
        Ok(_) => Ok(done(&format!("/organiser/stages/{id}"), "stage-changed")),
        Err(problem) => {
            let said = Done::default();
            page_with(&app, &organising, id, &said, Some(form), Some(&problem)).await
        }
    }
}

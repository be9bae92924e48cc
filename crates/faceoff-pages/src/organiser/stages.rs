//! `/organiser/stages`: the season's stages, and the making of another.

use super::stage_form::StageForm;
use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    figures::minute,
    frame::{Frame, PageProblem},
    signed_in::Organising,
    standing,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::stage::StageView;
use faceoff_service::{
    acts::staging,
    app::App,
    extract::PageForm,
    problem::Problem,
    views::{season::SeasonHead, stage},
};
use faceoff_types::Profile;

#[derive(Template)]
#[template(path = "organiser_stages.html")]
struct Page {
    frame: Frame,
    head: Head,
    stages: Vec<StageView>,
    form: StageForm,
    profiles: [Profile; 7],
    /// Nothing is to be confirmed of what is only made.
    confirm: Option<String>,
    is_refused: bool,
}

impl Page {
    fn phase(&self, stage: &StageView) -> &'static str {
        standing::phase(stage.phase, stage.finalised.is_some())
    }

    fn at(&self, at: &jiff::Timestamp) -> String {
        minute(*at)
    }
}

async fn page_with(
    app: &App,
    organising: &Organising,
    said: Said<'_>,
    form: Option<StageForm>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    let path = "/organiser/stages";
    let form = match form {
        Some(form) => form,
        None => StageForm::like(&stage::current(app).await?),
    };
    let page = Page {
        frame: Frame::of(app, season, path),
        head: Head::of(&organising.caller, path, said),
        stages: stage::all(app).await?,
        form,
        profiles: Profile::ALL,
        confirm: None,
        is_refused: matches!(said, Said::Refused(_)),
    };
    render_desk(&page, said)
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &organising, Said::Done(&said), None).await
}

pub(super) async fn create(
    organising: Organising,
    State(app): State<App>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let actor = organising.organiser.actor();
    let made = match form.new_stage() {
        Ok(new) => staging::create_stage(&app, actor, new).await,
        Err(problem) => Err(problem),
    };
    match made {
        Ok(_) => Ok(done("/organiser/stages", "stage-made")),
        Err(problem) => page_with(&app, &organising, Said::Refused(&problem), Some(form)).await,
    }
}

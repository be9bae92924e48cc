//! `/organiser/stages`: the season's stages, and the making of another.

use super::stage_form::StageForm;
use crate::{
    acts::staging,
    app::App,
    extract::PageForm,
    pages::{
        desk_frame::{self, Done, Head, done, render_desk},
        frame::{Frame, PageProblem},
        signed_in::{Organising, Refused},
    },
    problem::Problem,
    views::{
        season::SeasonHead,
        stage::{self, PhaseView, StageView},
    },
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Response},
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
        match stage.phase {
            PhaseView::Upcoming => "upcoming",
            PhaseView::Open => "open",
            PhaseView::Closed if stage.finalised.is_some() => "signed off",
            PhaseView::Closed => "closed, provisional",
        }
    }

    fn at(&self, at: &jiff::Timestamp) -> String {
        desk_frame::at(*at)
    }
}

async fn page_with(
    app: &App,
    organising: &Organising,
    said: &Done,
    form: Option<StageForm>,
    refused: Option<&Problem>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(app).await?.name;
    let path = "/organiser/stages";
    let form = match form {
        Some(form) => form,
        None => StageForm::like(&stage::current(app).await?),
    };
    let page = Page {
        frame: Frame::of(app, season, path),
        head: Head::of(&organising.caller, path, said).refusing(refused),
        stages: StageView::all(app).await?,
        form,
        profiles: Profile::ALL,
        confirm: None,
        is_refused: refused.is_some(),
    };
    render_desk(&page, refused)
}

pub(super) async fn page(
    organising: Result<Organising, Refused>,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    match organising {
        Ok(organising) => page_with(&app, &organising, &said, None, None).await,
        Err(refused) => Ok(refused.into_response()),
    }
}

/// Makes a stage.
pub(super) async fn create(
    organising: Result<Organising, Refused>,
    State(app): State<App>,
    form: Result<PageForm<StageForm>, Problem>,
) -> Result<Response, PageProblem> {
    let organising = match organising {
        Ok(organising) => organising,
        Err(refused) => return Ok(refused.into_response()),
    };
    let PageForm(form) = form?;
    let actor = organising.organiser.actor();
    let made = match form.new_stage() {
        Ok(new) => staging::create_stage(&app, actor, new).await,
        Err(problem) => Err(problem),
    };
    match made {
        Ok(_) => Ok(done("/organiser/stages", "stage-made")),
        Err(problem) => {
            let said = Done::default();
            page_with(&app, &organising, &said, Some(form), Some(&problem)).await
        }
    }
}

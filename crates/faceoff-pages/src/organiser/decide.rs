//! `/organiser/decide/…`: a decision's page says what it would do; its form does it.

use super::order::{Order, Sheet};
use crate::{
    desk_frame::{Head, Said, done, render_desk},
    frame::{Frame, PageProblem},
    signed_in::Organising,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::requests::Decision;
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
    views::season::SeasonHead,
};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "organiser_decide.html")]
struct Page {
    frame: Frame,
    head: Head,
    sheet: Sheet,
    reason: String,
}

async fn page_with(
    app: &App,
    organising: &Organising,
    order: Order,
    reason: String,
    said: Said<'_>,
) -> Result<Response, PageProblem> {
    let sheet = order.sheet(app).await?;
    let season = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, season, ""),
        head: Head::of(&organising.caller, "", said),
        sheet,
        reason,
    };
    render_desk(&page, said)
}

/// What it would do.
pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    order: Result<PathParam<Order>, Problem>,
) -> Result<Response, PageProblem> {
    page_with(&app, &organising, order?.0, String::new(), Said::Nothing).await
}

#[derive(Deserialize)]
pub(super) struct Form {
    #[serde(default)]
    reason: String,
    #[serde(default)]
    confirm: String,
}

/// Does it, and leads back; or says on the same page why not.
pub(super) async fn submit(
    organising: Organising,
    State(app): State<App>,
    order: Result<PathParam<Order>, Problem>,
    form: Result<PageForm<Form>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(order), PageForm(form)) = (order?, form?);
    // Asked before it is done, since it leads back to where it stood.
    let back = order.sheet(&app).await?.back;
    let decision = Decision {
        reason: form.reason.clone(),
        confirm: Some(form.confirm).filter(|confirm| !confirm.is_empty()),
    };
    let actor = organising.organiser.actor();
    match order.carry_out(&app, actor, decision).await {
        Ok(key) => Ok(done(&back, key)),
        Err(problem) => {
            page_with(
                &app,
                &organising,
                order,
                form.reason,
                Said::Refused(&problem),
            )
            .await
        }
    }
}

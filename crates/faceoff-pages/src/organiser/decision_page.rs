//! `/organiser/decide/…`: the page of a decision with a preview of its effects; the form executes it.

use super::decision::{Decision, DecisionPreview};
use crate::{
    dashboard_frame::{DashboardHeader, Notice, redirect_done, render_dashboard},
    frame::{Frame, NO_ENTRY, PageProblem},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::requests;
use faceoff_service::{
    app::App,
    extract::{PageForm, PathParam},
    problem::Problem,
};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "organiser_decision.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    preview: DecisionPreview,
    reason: String,
}

async fn page_with(
    app: &App,
    user: &PageOrganiser,
    decision: Decision,
    reason: String,
    notice: Notice<'_>,
) -> Result<Response, PageProblem> {
    let preview = decision.preview(app).await?;
    let page = Page {
        frame: Frame::load(app, NO_ENTRY).await?,
        head: DashboardHeader::new(&user.caller, NO_ENTRY, notice),
        preview,
        reason,
    };
    render_dashboard(&page, notice)
}

/// The preview of a decision, with its form.
pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    decision: Result<PathParam<Decision>, Problem>,
) -> Result<Response, PageProblem> {
    page_with(&app, &user, decision?.0, String::new(), Notice::None).await
}

#[derive(Deserialize)]
pub(super) struct Form {
    #[serde(default)]
    reason: String,
    #[serde(default)]
    confirm: String,
}

/// Executes the decision and redirects back, or shows an error on the same page.
pub(super) async fn submit(
    user: PageOrganiser,
    State(app): State<App>,
    decision: Result<PathParam<Decision>, Problem>,
    form: Result<PageForm<Form>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(decision), PageForm(form)) = (decision?, form?);
    let request = requests::Decision {
        reason: form.reason.clone(),
        confirm: Some(form.confirm).filter(|confirm| !confirm.is_empty()),
    };
    match decision.carry_out(&app, &user.organiser, request).await {
        Ok(outcome) => Ok(redirect_done(&outcome.return_path, outcome.notice)),
        Err(problem) => {
            page_with(
                &app,
                &user,
                decision,
                form.reason,
                Notice::Refused(&problem),
            )
            .await
        }
    }
}

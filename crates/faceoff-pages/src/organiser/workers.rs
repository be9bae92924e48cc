//! `/organiser/workers`: *slots* of this server, each of which runs one job at a time, *remote workers*, which run jobs on other
//! machines, and banned workers.

use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice},
    frame::{Frame, PageProblem, render},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::workers::{WorkerState, WorkerView, WorkersView};
use faceoff_service::{app::App, views::workers};

#[derive(Template)]
#[template(path = "organiser_workers.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    workers: WorkersView,
}

impl Page {
    /// CSS class and label of the state.
    fn state(&self, worker: &WorkerView) -> (&'static str, &'static str) {
        match worker.state {
            WorkerState::Working => ("good", "working"),
            WorkerState::Idle => ("good", "idle"),
            WorkerState::Refused => ("bad", "gets no jobs"),
            WorkerState::Silent => ("waiting", "silent"),
        }
    }
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(done): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    let path = "/organiser/workers";
    render(&Page {
        frame: Frame::load(&app, path).await?,
        head: DashboardHeader::new(&user.caller, path, Notice::Done(&done)),
        workers: workers::with_bans(&app).await?,
    })
}

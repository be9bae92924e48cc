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
use faceoff_service::{
    app::App,
    views::{season::SeasonHead, workers},
};
use jiff::Timestamp;

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

    fn timestamp(&self, instant: &Timestamp) -> String {
        instant.strftime("%Y-%m-%d %H:%M UTC").to_string()
    }
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(done): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::load(&app).await?.name;
    let path = "/organiser/workers";
    render(&Page {
        frame: Frame::for_app(&app, season, path),
        head: DashboardHeader::new(&user.caller, path, Notice::Done(&done)),
        workers: workers::with_bans(&app).await?,
    })
}

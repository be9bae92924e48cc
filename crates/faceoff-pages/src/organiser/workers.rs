//! `/organiser/workers`: who plays, on this machine and on others.

use crate::{
    desk_frame::{Done, Head, Said},
    frame::{Frame, PageProblem, render},
    signed_in::Organising,
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
    head: Head,
    of: WorkersView,
}

impl Page {
    /// The sign of its state, and what that is called.
    fn state(&self, worker: &WorkerView) -> (&'static str, &'static str) {
        match worker.state {
            WorkerState::Working => ("good", "works"),
            WorkerState::Idle => ("good", "waits for work"),
            WorkerState::Refused => ("bad", "gets no work"),
            WorkerState::Silent => ("waiting", "silent"),
        }
    }

    fn minute(&self, at: &Timestamp) -> String {
        at.strftime("%Y-%m-%d %H:%M UTC").to_string()
    }
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    Query(done): Query<Done>,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(&app).await?.name;
    let path = "/organiser/workers";
    render(&Page {
        frame: Frame::of(&app, season, path),
        head: Head::of(&organising.caller, path, Said::Done(&done)),
        of: workers::with_bans(&app).await?,
    })
}

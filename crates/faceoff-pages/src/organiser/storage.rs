//! `/organiser/storage`: free space of the disks, and storage by team.

use crate::{
    dashboard_frame::{self, DashboardHeader, Notice},
    frame::{Frame, PageProblem, render},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::storage::StorageView;
use faceoff_service::{app::App, views::storage};
use faceoff_types::{StageId, StageName};

#[derive(Template)]
#[template(path = "organiser_storage.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    disks: Vec<Disk>,
    /// Free space below which the queue is paused, and whether a disk has less.
    min_free: String,
    is_short: bool,
    teams: Vec<StorageView>,
    /// Stages with their *retention*: which files the server keeps, and for how long.
    stages: Vec<(StageId, StageName, String)>,
}

/// A file system that the server writes to.
struct Disk {
    free: String,
    size: String,
    used_percent: u64,
}

impl Page {
    fn bytes(&self, bytes: &u64) -> String {
        dashboard_frame::bytes(*bytes)
    }
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let space = app.store.free_space();
    let disks = space.disks().into_iter().flatten().map(|disk| Disk {
        free: dashboard_frame::bytes(disk.free_bytes),
        size: dashboard_frame::bytes(disk.size_bytes),
        used_percent: 100
            - (100 * disk.free_bytes)
                .checked_div(disk.size_bytes)
                .unwrap_or(100)
                .min(100),
    });
    let mut disks: Vec<Disk> = disks.collect();
    // Monitored folders may be on the same disk.
    disks.dedup_by(|disk, other| (&disk.free, &disk.size) == (&other.free, &other.size));
    let mut stages = Vec::new();
    for stage in app.store.stages().await? {
        let retention = app.store.stage_retention(stage.id).await?;
        stages.push((stage.id, stage.name, retention.to_string()));
    }
    let mut teams = storage::all(&app).await?;
    teams.sort_by_key(|team| std::cmp::Reverse(team.bundle_bytes + team.dataset_bytes));
    let path = "/organiser/storage";
    let page = Page {
        frame: Frame::load(&app, path).await?,
        head: DashboardHeader::new(&user.caller, path, Notice::None),
        disks,
        min_free: dashboard_frame::bytes(space.min_free_bytes()),
        is_short: space.is_short(),
        teams,
        stages,
    };
    render(&page)
}

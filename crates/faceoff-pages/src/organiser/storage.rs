//! `/organiser/storage`: what the disks have, and what the teams' files take.

use crate::{
    desk_frame::{self, Head, Said},
    frame::{Frame, PageProblem, render},
    signed_in::Organising,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::storage::StorageView;
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{season::SeasonHead, storage},
};
use faceoff_types::{StageId, StageName};

#[derive(Template)]
#[template(path = "organiser_storage.html")]
struct Page {
    frame: Frame,
    head: Head,
    disks: Vec<Disk>,
    kept_free: String,
    is_short: bool,
    teams: Vec<StorageView>,
    /// Each with what is kept of its files.
    stages: Vec<(StageId, StageName, String)>,
}

/// A file system that the server writes to.
struct Disk {
    free: String,
    size: String,
    used: u64,
}

impl Page {
    fn bytes(&self, bytes: &u64) -> String {
        desk_frame::bytes(*bytes)
    }
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let room = app.store.room();
    let disks = room.disks().into_iter().flatten().map(|disk| Disk {
        free: desk_frame::bytes(disk.free_bytes),
        size: desk_frame::bytes(disk.size_bytes),
        used: 100
            - (100 * disk.free_bytes)
                .checked_div(disk.size_bytes)
                .unwrap_or(100)
                .min(100),
    });
    let mut disks: Vec<Disk> = disks.collect();
    // Folders that are watched may be on the same disk.
    disks.dedup_by(|one, other| (&one.free, &one.size) == (&other.free, &other.size));
    let mut stages = Vec::new();
    for stage in app.store.stages().await.map_err(Problem::from)? {
        let kept = app
            .store
            .stage_retention(stage.id)
            .await
            .map_err(Problem::from)?;
        stages.push((stage.id, stage.name, kept.to_string()));
    }
    let mut teams = storage::all(&app).await?;
    teams.sort_by_key(|team| std::cmp::Reverse(team.archive_bytes + team.dataset_bytes));
    let season = SeasonHead::now(&app).await?.name;
    let path = "/organiser/storage";
    let page = Page {
        frame: Frame::of(&app, season, path),
        head: Head::of(&organising.caller, path, Said::Nothing),
        disks,
        kept_free: desk_frame::bytes(room.min_free_bytes()),
        is_short: room.is_short(),
        teams,
        stages,
    };
    render(&page)
}

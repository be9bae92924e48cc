//! Stages: opening times, rules and the next cutoff. A *stage* is a part of the season with its own rules, board and daily
//! evaluations; a *revision* is a version of its rules.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    viewer::Viewer,
    views::{capacity, day, decision, sign_off},
};
use faceoff_api::views::stage::{PhaseView, RevisionView, StageView};
use faceoff_store::{Revision, Stage, StagePhase};
use faceoff_types::StageId;

pub fn revision(revision: Revision) -> RevisionView {
    RevisionView {
        revision: revision.number,
        since: revision.since,
        rules: revision.rules,
    }
}

pub fn phase(phase: StagePhase) -> PhaseView {
    match phase {
        StagePhase::Upcoming => PhaseView::Upcoming,
        StagePhase::Open => PhaseView::Open,
        StagePhase::Closed => PhaseView::Closed,
    }
}

/// All stages, in order of their opening, without capacity forecasts.
#[boxed_future]
pub async fn all(app: &AppState) -> Result<Vec<StageView>, Problem> {
    let mut views = Vec::new();
    for stage in app.store.stages().await? {
        views.push(build(app, stage).await?);
    }
    Ok(views)
}

/// A stage without its capacity forecast.
#[boxed_future]
pub async fn find(app: &AppState, id: StageId) -> Result<StageView, Problem> {
    build(app, app.store.stage(id).await?).await
}

/// Adds the capacity forecast, if the viewer may see it.
#[boxed_future]
pub async fn for_viewer(
    view: StageView,
    app: &AppState,
    viewer: Viewer,
) -> Result<StageView, Problem> {
    let capacity = match viewer {
        // An archived season has no slots.
        Viewer::Organiser if app.store.archived_season().is_none() => {
            Some(capacity::build(app, view.id).await?.days)
        }
        Viewer::Organiser | Viewer::Team(_) | Viewer::Visitor => None,
    };
    Ok(StageView { capacity, ..view })
}

/// All stages as the viewer may see them, in order of their opening.
#[boxed_future]
pub async fn all_for_viewer(app: &AppState, viewer: Viewer) -> Result<Vec<StageView>, Problem> {
    let mut views = Vec::new();
    for view in all(app).await? {
        views.push(for_viewer(view, app, viewer).await?);
    }
    Ok(views)
}

/// A stage without its capacity forecast.
#[boxed_future]
pub async fn build(app: &AppState, stage: Stage) -> Result<StageView, Problem> {
    let revisions = app.store.stage_revisions(stage.id).await?;
    Ok(StageView {
        retention: app.store.stage_retention(stage.id).await?,
        next_cutoff: day::next_cutoff(app, &stage).await?,
        frozen: app.store.board_freeze(stage.id).await?.map(decision::view),
        phase: phase(stage.phase(app.config.clock.now())),
        id: stage.id,
        name: stage.name,
        opens_at: stage.opens_at,
        closes_at: stage.closes_at,
        zone: stage.zone,
        names_seeds: stage.seeds_derive_from_id,
        configured: stage.configured,
        sign_off: stage.sign_off.map(sign_off::view),
        settings: stage.settings,
        rules: revision(stage.revision),
        revisions: revisions.into_iter().map(revision).collect(),
        capacity: None,
    })
}

/// The stage of requests that name none: the open one, or the nearest in time.
#[boxed_future]
pub async fn current(app: &AppState) -> Result<Stage, Problem> {
    let current = app.store.current_stage(app.config.clock.now()).await?;
    current.ok_or_else(|| Problem::internal("the season has no stage"))
}

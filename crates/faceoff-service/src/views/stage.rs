//! A stage: when it is open, by which rules it is played, and when its next day starts.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    viewer::Viewer,
    views::{capacity, day, finalised, ruling},
};
use faceoff_api::views::stage::{PhaseView, RevisionView, StageView};
use faceoff_store::{Revision, Stage, StagePhase};
use faceoff_types::StageId;

/// A revision of the rules.
pub fn revision(revision: Revision) -> RevisionView {
    RevisionView {
        revision: revision.number,
        since: revision.since,
        rules: revision.rules,
    }
}

/// Where a stage is.
pub fn phase(phase: StagePhase) -> PhaseView {
    match phase {
        StagePhase::Upcoming => PhaseView::Upcoming,
        StagePhase::Open => PhaseView::Open,
        StagePhase::Closed => PhaseView::Closed,
    }
}

/// All of the season, the first to open first.
#[boxed]
pub async fn all(app: &AppState) -> Result<Vec<StageView>, Problem> {
    let mut views = Vec::new();
    for stage in app.store.stages().await? {
        views.push(of(app, stage).await?);
    }
    Ok(views)
}

/// One, as everybody sees it.
#[boxed]
pub async fn find(app: &AppState, id: StageId) -> Result<StageView, Problem> {
    of(app, app.store.stage(id).await?).await
}

/// As the viewer sees it.
#[boxed]
pub async fn seen_by(
    view: StageView,
    app: &AppState,
    viewer: Viewer,
) -> Result<StageView, Problem> {
    let capacity = match viewer {
        // an archive has no slots that could play a day
        Viewer::Organiser if app.store.archived().is_none() => {
            Some(capacity::of(app, view.id).await?.days)
        }
        Viewer::Organiser | Viewer::Team(_) | Viewer::Anybody => None,
    };
    Ok(StageView { capacity, ..view })
}

/// All of the season as the viewer sees them, the first to open first.
#[boxed]
pub async fn all_seen_by(app: &AppState, viewer: Viewer) -> Result<Vec<StageView>, Problem> {
    let mut views = Vec::new();
    for view in all(app).await? {
        views.push(seen_by(view, app, viewer).await?);
    }
    Ok(views)
}

/// One, as everybody sees it.
#[boxed]
pub async fn of(app: &AppState, stage: Stage) -> Result<StageView, Problem> {
    let revisions = app.store.stage_revisions(stage.id).await?;
    Ok(StageView {
        retention: app.store.stage_retention(stage.id).await?,
        next_cut: day::next_cut(app, &stage).await?,
        frozen: app.store.boards_frozen(stage.id).await?.map(ruling::of),
        phase: phase(stage.phase(app.config.clock.now())),
        id: stage.id,
        name: stage.name,
        opens_at: stage.opens_at,
        closes_at: stage.closes_at,
        zone: stage.zone,
        names_seeds: stage.names_seeds,
        configured: stage.configured,
        finalised: stage.finalised.map(finalised::of),
        settings: stage.settings,
        rules: revision(stage.rules),
        revisions: revisions.into_iter().map(revision).collect(),
        capacity: None,
    })
}

/// The stage that a request is about which names none: the open one, or the nearest.
#[boxed]
pub async fn current(app: &AppState) -> Result<Stage, Problem> {
    let current = app.store.current_stage(app.config.clock.now()).await?;
    current.ok_or_else(|| Problem::internal("the season has no stage"))
}

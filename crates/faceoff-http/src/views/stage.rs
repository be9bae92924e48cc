//! A stage: when it is open, by which rules it is played, and when its next day starts.

use super::{
    capacity::{CapacityView, DayLoad},
    day::NextCut,
    finalised::FinalisedView,
    ruling::RulingView,
};
use crate::{app::AppState, problem::Problem, viewer::Viewer};
use faceoff_store::{Revision, Stage, StagePhase};
use faceoff_types::{Retention, StageId, StageName, StageRules, StageSettings, Zone};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A part of the season with its own days, rules and board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageView {
    /// Names the stage in paths, and enters the seeds of its days.
    pub id: StageId,
    /// As the organiser named it.
    pub name: StageName,
    /// Where it is now.
    pub phase: PhaseView,
    /// From then on its days start, and its rules are fixed.
    pub opens_at: Timestamp,
    /// From then on none of its days starts; null: it has no end yet.
    pub closes_at: Option<Timestamp>,
    /// Its days are dates there, and its schedule is of its clocks.
    pub zone: Zone,
    /// When its next day starts; null if none does.
    pub next_cut: Option<NextCut>,
    /// Its boards show what they showed then: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Do the seeds of its days follow from its id? Not of a season's first stage, if that began before there were
    /// stages.
    pub names_seeds: bool,
    /// Does it take rules and settings from the server's configuration, at each start?
    pub configured: bool,
    /// Its result is signed off, if it is: nothing of it changes any more. Null: its result is provisional.
    pub finalised: Option<FinalisedView>,
    /// What is kept of its datasets and of the archives of what has played it; `{}`: everything.
    #[serde(default)]
    pub retention: Retention,
    /// What no score depends on.
    #[serde(flatten)]
    pub settings: StageSettings,
    /// What scores depend on, as they are now.
    #[serde(flatten)]
    pub rules: RevisionView,
    /// All rules that it has had, the first ones first. A board shows results of one revision.
    pub revisions: Vec<RevisionView>,
    /// Do its days fit: those under way and the next one. For organisers, absent for everybody else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity: Option<Vec<DayLoad>>,
}

/// Where a stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseView {
    /// It opens later.
    Upcoming,
    /// Its days start.
    Open,
    /// It is over.
    Closed,
}

/// Rules from one time on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RevisionView {
    /// From 1.
    pub revision: u32,
    /// When they became the stage's.
    pub since: Timestamp,
    /// Themselves.
    #[serde(flatten)]
    pub rules: StageRules,
}

impl From<Revision> for RevisionView {
    fn from(revision: Revision) -> Self {
        Self {
            revision: revision.number,
            since: revision.since,
            rules: revision.rules,
        }
    }
}

impl From<StagePhase> for PhaseView {
    fn from(phase: StagePhase) -> Self {
        match phase {
            StagePhase::Upcoming => Self::Upcoming,
            StagePhase::Open => Self::Open,
            StagePhase::Closed => Self::Closed,
        }
    }
}

impl StageView {
    /// All of the season, the first to open first.
    pub(crate) async fn all(app: &AppState) -> Result<Vec<Self>, Problem> {
        let mut views = Vec::new();
        for stage in app.store.stages().await? {
            views.push(Self::of(app, stage).await?);
        }
        Ok(views)
    }

    pub(crate) async fn find(app: &AppState, id: StageId) -> Result<Self, Problem> {
        Self::of(app, app.store.stage(id).await?).await
    }

    /// As the viewer sees it.
    pub(crate) async fn seen_by(self, app: &AppState, viewer: Viewer) -> Result<Self, Problem> {
        let capacity = match viewer {
            // an archive has no slots that could play a day
            Viewer::Organiser if app.store.archived().is_none() => {
                Some(CapacityView::of(app, self.id).await?.days)
            }
            Viewer::Organiser | Viewer::Team(_) | Viewer::Anybody => None,
        };
        Ok(Self { capacity, ..self })
    }

    /// All of the season as the viewer sees them, the first to open first.
    pub(crate) async fn all_seen_by(app: &AppState, viewer: Viewer) -> Result<Vec<Self>, Problem> {
        let mut views = Vec::new();
        for view in Self::all(app).await? {
            views.push(view.seen_by(app, viewer).await?);
        }
        Ok(views)
    }

    pub(crate) async fn of(app: &AppState, stage: Stage) -> Result<Self, Problem> {
        let revisions = app.store.stage_revisions(stage.id).await?;
        Ok(Self {
            retention: app.store.stage_retention(stage.id).await?,
            next_cut: NextCut::of(app, &stage).await?,
            frozen: app
                .store
                .boards_frozen(stage.id)
                .await?
                .map(RulingView::from),
            phase: stage.phase(app.config.clock.now()).into(),
            id: stage.id,
            name: stage.name,
            opens_at: stage.opens_at,
            closes_at: stage.closes_at,
            zone: stage.zone,
            names_seeds: stage.names_seeds,
            configured: stage.configured,
            finalised: stage.finalised.map(FinalisedView::from),
            settings: stage.settings,
            rules: stage.rules.into(),
            revisions: revisions.into_iter().map(RevisionView::from).collect(),
            capacity: None,
        })
    }
}

/// The stage that a request is about which names none: the open one, or the nearest.
pub(crate) async fn current(app: &AppState) -> Result<Stage, Problem> {
    let current = app.store.current_stage(app.config.clock.now()).await?;
    current.ok_or_else(|| Problem::internal("the season has no stage"))
}

//! The day's cut: what it brought about, and when the next one is.

use super::{
    evaluation::EvaluationView,
    not_taken::{self, NotTakenTeam},
    sight::Sight,
    team::TeamView,
};
use crate::{app::AppState, problem::Problem};
use faceoff_store::Stage;
use faceoff_types::{StageDay, StageId, StageName, TeamId, Zone};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt};
use utoipa::ToSchema;

/// What starting the day did, as the organiser sees it.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct DayView {
    /// Whose day.
    pub stage: StageId,
    /// Its date in the stage's zone.
    pub day: Date,
    /// One evaluation for each team that had a submission active.
    pub created: Vec<EvaluationView>,
    /// Teams that have no valid submission; what they upload now plays another day.
    pub without_submission: Vec<TeamView>,
    /// Teams that have one whose runtime the stage does not take, and why; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_taken: Vec<NotTakenTeam>,
}

impl DayView {
    pub(crate) async fn of(app: &AppState, of: StageDay) -> Result<Self, Problem> {
        let sight = Sight::of_organiser(app).await?;
        let mut created = EvaluationView::of_day(app, &sight, of).await?;
        EvaluationView::place(app, &mut created).await?;
        let evaluated: BTreeSet<TeamId> = created.iter().map(|created| created.team).collect();
        let mut without_submission = TeamView::all(app).await?;
        let mut not_taken = not_taken::by(app, &app.store.stage(of.stage).await?).await?;
        not_taken.retain(|left_out| !evaluated.contains(&left_out.team));
        let is_left_out = |id| not_taken.iter().any(|left_out| left_out.team == id);
        without_submission.retain(|team| !evaluated.contains(&team.id) && !is_left_out(team.id));
        Ok(Self {
            stage: of.stage,
            day: of.date,
            created,
            without_submission,
            not_taken,
        })
    }
}

/// When the next day starts, with what each team has active then.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NextCut {
    /// Of which stage.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// Its date in the stage's zone; the earliest, where the organiser starts it.
    pub day: Date,
    /// By the schedule; null where the organiser starts the day.
    pub at: Option<Timestamp>,
    /// Where the day is a date.
    pub zone: Zone,
}

impl NextCut {
    /// Of a stage; `None` if it has no other day, or the season is closed.
    pub(crate) async fn of(app: &AppState, stage: &Stage) -> Result<Option<Self>, Problem> {
        if app.store.season().await?.closed_at.is_some() {
            return Ok(None);
        }
        let newest = app.store.newest_day(stage.id).await?;
        let next = stage.next_cut(newest.map(|day| day.of.date), app.config.clock.now());
        Ok(next.map(|(day, at)| Self {
            stage: stage.id,
            stage_name: stage.name.clone(),
            day,
            at,
            zone: stage.zone.clone(),
        }))
    }

    /// The first of all stages; `None` if none has another day, or the season is closed.
    pub(crate) async fn first(app: &AppState) -> Result<Option<Self>, Problem> {
        let mut first: Option<(Timestamp, Self)> = None;
        for stage in app.store.stages().await? {
            let Some(next) = Self::of(app, &stage).await? else {
                continue;
            };
            let begins = next.day.to_zoned(stage.zone.time_zone());
            let begins = begins.map_err(Problem::internal)?.timestamp();
            let at = next.at.unwrap_or(begins);
            if first.as_ref().is_none_or(|(earliest, _)| at < *earliest) {
                first = Some((at, next));
            }
        }
        Ok(first.map(|(_, next)| next))
    }
}

impl fmt::Display for NextCut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(at) => {
                let there = at.to_zoned(self.zone.time_zone());
                write!(
                    f,
                    "{} {}",
                    there.strftime("%Y-%m-%d at %H:%M:%S"),
                    self.zone
                )
            }
            None => write!(
                f,
                "{} ({}) or later, when the organiser starts the day",
                self.day, self.zone
            ),
        }
    }
}

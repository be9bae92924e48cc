//! The day's cut: what it brought about, and when the next one is.

use super::{evaluation::EvaluationView, team::TeamView};
use crate::{app::AppState, problem::Problem};
use faceoff_types::TeamId;
use jiff::{Timestamp, civil::Date, tz::TimeZone};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt};
use utoipa::ToSchema;

/// What starting the day did.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct DayView {
    /// In UTC.
    pub day: Date,
    /// One evaluation for each team that had a submission active.
    pub created: Vec<EvaluationView>,
    /// Teams that have no valid submission; what they upload now plays another day.
    pub without_submission: Vec<TeamView>,
}

impl DayView {
    pub(crate) async fn of(app: &AppState, day: Date) -> Result<Self, Problem> {
        let created = EvaluationView::all_on(app, day).await?;
        let evaluated: BTreeSet<TeamId> = created.iter().map(|created| created.team).collect();
        let mut without_submission = TeamView::all(app).await?;
        without_submission.retain(|team| !evaluated.contains(&team.id));
        Ok(Self {
            day,
            created,
            without_submission,
        })
    }
}

/// When the next day starts, with what each team has active then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NextCut {
    /// In UTC; the earliest, where the organiser starts it.
    pub day: Date,
    /// By the schedule; null where the organiser starts the day.
    pub at: Option<Timestamp>,
}

impl NextCut {
    /// `None` once the season is closed.
    pub(crate) async fn unless_closed(app: &AppState) -> Result<Option<Self>, Problem> {
        match app.store.season().await?.closed_at {
            Some(_) => Ok(None),
            None => Self::of(app).await.map(Some),
        }
    }

    /// Of a season that is open.
    pub(crate) async fn of(app: &AppState) -> Result<Self, Problem> {
        let today = app.config.clock.today();
        let day = match app.store.newest_day().await? {
            Some(newest) if newest.date >= today => {
                newest.date.tomorrow().map_err(Problem::internal)?
            }
            _ => today,
        };
        let at = app.config.daily_at.map(|at| {
            let start = day.to_datetime(at).to_zoned(TimeZone::UTC);
            start.map(|start| start.timestamp())
        });
        let at = at.transpose().map_err(Problem::internal)?;
        Ok(Self { day, at })
    }
}

impl fmt::Display for NextCut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(at) => write!(f, "{}", at.strftime("%Y-%m-%d at %H:%M UTC")),
            None => write!(
                f,
                "{} (UTC) or later, when the organiser starts the day",
                self.day
            ),
        }
    }
}

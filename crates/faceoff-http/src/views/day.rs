//! What the start of a day brought about.

use super::{evaluation::EvaluationView, team::TeamView};
use crate::{app::AppState, problem::Problem};
use faceoff_types::{EvaluationId, TeamId};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use utoipa::ToSchema;

/// What starting the day did.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct DayView {
    /// In UTC.
    pub day: Date,
    /// Evaluations that this request queued.
    pub created: Vec<EvaluationView>,
    /// Evaluations of the day that existed before.
    pub existing: Vec<EvaluationView>,
    /// Teams without an evaluation today: they have no valid submission, or none that was uploaded
    /// before the day's seed was released.
    pub without_submission: Vec<TeamView>,
}

impl DayView {
    /// Of a day on which these evaluations were just `created`.
    pub(crate) async fn of(
        app: &AppState,
        day: Date,
        created: BTreeSet<EvaluationId>,
    ) -> Result<Self, Problem> {
        let all = EvaluationView::all_on(app, day).await?;
        let evaluated: BTreeSet<TeamId> = all.iter().map(|evaluation| evaluation.team).collect();
        let mut without_submission = TeamView::all(app).await?;
        without_submission.retain(|team| !evaluated.contains(&team.id));
        let (created, existing) = all
            .into_iter()
            .partition(|evaluation| created.contains(&evaluation.id));
        Ok(Self {
            day,
            created,
            existing,
            without_submission,
        })
    }
}

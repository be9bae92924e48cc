//! Two evaluations on the same episodes, compared.

use super::schema::{self, ProblemBody};
use crate::{
    App, AppState,
    extract::TwoPathParams,
    problem::{Problem, ProblemKind},
};
use axum::{Json, extract::State};
use faceoff_scoring::{Comparison, EpisodeSummary, OverallComparison, Played, TaskComparison};
use faceoff_store::{Evaluation, EvaluationState};
use faceoff_types::{EvaluationId, EvaluationResult, Profile, Seed, Task, TeamName};
use jiff::civil;
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, sync::Arc};
use utoipa::ToSchema;

/// Two evaluations on the same episodes. Differences are A minus B.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparisonView {
    /// The first evaluation.
    pub a: ComparedView,
    /// The second evaluation.
    pub b: ComparedView,
    /// The UTC day whose episodes both played.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// The rules.
    pub ruleset: String,
    /// The perturbation profile.
    #[schema(value_type = String, example = "evaluation")]
    pub profile: Profile,
    /// By task: hit, defend, prepare.
    #[schema(value_type = BTreeMap<String, schema::TaskComparison>)]
    pub tasks: BTreeMap<Task, TaskComparison>,
    /// The overall scores.
    #[schema(value_type = schema::OverallComparison)]
    pub overall: OverallComparison,
}

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparedView {
    /// The evaluation.
    #[schema(value_type = String, format = Uuid)]
    pub evaluation: EvaluationId,
    /// Its team's name.
    #[schema(value_type = String)]
    pub team: TeamName,
}

/// A finished evaluation with what a comparison needs.
struct Side {
    evaluation: Evaluation,
    result: Box<EvaluationResult>,
    summary: Arc<EpisodeSummary>,
}

impl Side {
    async fn load(app: &AppState, id: EvaluationId) -> Result<Self, Problem> {
        let evaluation = app
            .store
            .evaluation(id)
            .await
            .map_err(|error| match error {
                faceoff_store::StoreError::NotFound(_) => Problem::new(
                    ProblemKind::NotFound,
                    format!("there is no evaluation {id}; check the id"),
                ),
                error => error.into(),
            })?;
        let EvaluationState::Finished { result, .. } = &evaluation.state else {
            return Err(Problem::new(
                ProblemKind::Conflict,
                format!(
                    "evaluation {id} has no result, so there is nothing to compare; only finished \
                     evaluations are compared"
                ),
            ));
        };
        let result = result.clone();
        Ok(Self {
            summary: app.summary(evaluation.run).await?,
            evaluation,
            result,
        })
    }

    fn played(&self, mismatch_seed: Seed) -> Played<'_> {
        Played {
            ruleset: &self.result.ruleset,
            profile: self.result.profile,
            seed: self.result.seed,
            mismatch_seed,
            summary: &self.summary,
        }
    }

    async fn view(&self, app: &AppState) -> Result<ComparedView, Problem> {
        Ok(ComparedView {
            evaluation: self.evaluation.id,
            team: app.store.team(self.evaluation.team).await?.name,
        })
    }
}

/// Compares two finished evaluations.
pub(crate) async fn comparison(
    app: &AppState,
    a: EvaluationId,
    b: EvaluationId,
) -> Result<ComparisonView, Problem> {
    let (a, b) = (Side::load(app, a).await?, Side::load(app, b).await?);
    let not_paired = |field: &str, detail: String| {
        Problem::new(
            ProblemKind::NotPaired,
            format!("{detail}; only evaluations that played the same episodes are compared"),
        )
        .with("field", field)
    };
    let (day_a, day_b) = (a.evaluation.day, b.evaluation.day);
    if day_a != day_b {
        return Err(not_paired(
            "day",
            format!("day: the first evaluation is of {day_a}, the second of {day_b}"),
        ));
    }
    // that of the season, which both share
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let Comparison { tasks, overall } =
        a.played(mismatch_seed)
            .compare(&b.played(mismatch_seed))
            .map_err(|error| not_paired(error.field(), error.to_string()))?;
    Ok(ComparisonView {
        a: a.view(app).await?,
        b: b.view(app).await?,
        day: day_a,
        ruleset: a.result.ruleset.clone(),
        profile: a.result.profile,
        tasks,
        overall,
    })
}

/// Compares two finished evaluations of the same day: counts of paired episodes, McNemar's exact test
/// and the difference with its interval, by task and overall.
#[utoipa::path(
    get, path = "/evaluations/{id}/compare/{other}", tag = "public",
    params(("id" = String, Path, format = Uuid), ("other" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = ComparisonView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
        (status = 409, description = "not the same episodes (“field” says what differs), or not finished", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn compare(
    State(app): State<App>,
    TwoPathParams(a, b): TwoPathParams<EvaluationId>,
) -> Result<Json<ComparisonView>, Problem> {
    comparison(&app, a, b).await.map(Json)
}

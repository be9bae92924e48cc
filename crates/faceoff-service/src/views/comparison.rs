//! Paired comparison of two evaluations: a statistical test of the difference between their results on the same episodes.

use crate::{
    app::AppState,
    boxed_future,
    day_release::check_released,
    problem::{Problem, ProblemKind},
    views::visibility::Visibility,
};
use faceoff_api::{
    requests::ComparisonQuery,
    views::comparison::{ComparedView, ComparisonView},
};
use faceoff_scoring::{ComparedEvaluation, Comparison, EpisodeSummary, NotComparable};
use faceoff_store::{Evaluation, EvaluationState, StoreError};
use faceoff_types::{EvaluationId, EvaluationResult, Seed, TaskWeights};
use std::sync::Arc;

/// One of the two evaluations, which are both finished, with the data for the comparison.
struct Side {
    evaluation: Evaluation,
    result: Box<EvaluationResult>,
    weights: TaskWeights,
    summary: Arc<EpisodeSummary>,
}

impl Side {
    async fn load(
        app: &AppState,
        visibility: &Visibility,
        id: EvaluationId,
    ) -> Result<Self, Problem> {
        let evaluation = app
            .store
            .evaluation(id)
            .await
            .map_err(|error| match error {
                StoreError::NotFound(_) => Problem::new(
                    ProblemKind::NotFound,
                    format!("there is no evaluation {id}; check the id"),
                ),
                error => error.into(),
            })?;
        visibility.check_not_blind(evaluation.stage_day.stage)?;
        let EvaluationState::Finished { result, .. } = &evaluation.state else {
            return Err(Problem::new(
                ProblemKind::Conflict,
                format!("evaluation {id} has no result; only finished evaluations can be compared"),
            ));
        };
        let result = result.clone();
        Ok(Self {
            weights: app.config.competition().weights(&result.variation),
            summary: app.summaries.load_run(evaluation.run).await?,
            evaluation,
            result,
        })
    }

    /// The evaluation in the form that statistical comparisons take.
    fn to_compared(&self, mismatch_seed: Seed) -> ComparedEvaluation<'_> {
        ComparedEvaluation {
            ruleset: &self.result.ruleset,
            profile: self.result.profile,
            variation: &self.result.variation,
            weights: &self.weights,
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
///
/// # Errors
/// `NotFound`; `Conflict` while one has no result; `Blind` until their stage is revealed; `NotYet` until their day is
/// released; `NotPaired` if their episodes differ.
#[boxed_future]
pub async fn compare(
    app: &AppState,
    visibility: &Visibility,
    [a, b]: [EvaluationId; 2],
    query: ComparisonQuery,
) -> Result<ComparisonView, Problem> {
    let (a, b) = (
        Side::load(app, visibility, a).await?,
        Side::load(app, visibility, b).await?,
    );
    let not_paired = |field: &str, detail: String| {
        Problem::new(
            ProblemKind::NotPaired,
            format!("{detail}; only evaluations on the same episodes can be compared"),
        )
        .with("field", field)
    };
    let (stage_a, stage_b) = (a.evaluation.stage_day.stage, b.evaluation.stage_day.stage);
    if stage_a != stage_b {
        return Err(not_paired(
            "stage",
            format!("stage: the first evaluation is of {stage_a}, the second of {stage_b}"),
        ));
    }
    let (day_a, day_b) = (a.evaluation.stage_day.date, b.evaluation.stage_day.date);
    if day_a != day_b {
        return Err(not_paired(
            "day",
            format!("day: the first evaluation is of {day_a}, the second of {day_b}"),
        ));
    }
    check_released(app, &a.evaluation).await?;
    for side in [&a, &b] {
        visibility.check_not_frozen(&side.evaluation, "compared")?;
    }
    // The seed of model mismatch is the same for the whole season.
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let (compared_a, compared_b) = (a.to_compared(mismatch_seed), b.to_compared(mismatch_seed));
    let not_comparable = |error: NotComparable| not_paired(error.field(), error.to_string());
    let Comparison { tasks, overall } = compared_a.compare(&compared_b).map_err(not_comparable)?;
    let episodes = match query.episodes {
        true => Some(
            compared_a
                .solved_episodes(&compared_b)
                .map_err(not_comparable)?,
        ),
        false => None,
    };
    Ok(ComparisonView {
        a: a.view(app).await?,
        b: b.view(app).await?,
        day: day_a,
        ruleset: a.result.ruleset.clone(),
        profile: a.result.profile,
        tasks,
        overall,
        episodes,
    })
}

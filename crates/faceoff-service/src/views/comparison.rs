//! Whether one of two agents is better, by the episodes that both played.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    release::check_released,
    views::sight::Sight,
};
use faceoff_api::{
    requests::ComparisonQuery,
    views::comparison::{ComparedView, ComparisonView},
};
use faceoff_scoring::{Comparison, EpisodeSummary, NotPaired, Played};
use faceoff_store::{Evaluation, EvaluationState, StoreError};
use faceoff_types::{EvaluationId, EvaluationResult, Seed};
use std::sync::Arc;

/// A finished evaluation with what a comparison needs.
struct Side {
    evaluation: Evaluation,
    result: Box<EvaluationResult>,
    summary: Arc<EpisodeSummary>,
}

impl Side {
    async fn load(app: &AppState, sight: &Sight, id: EvaluationId) -> Result<Self, Problem> {
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
        sight.check_shown(evaluation.of.stage)?;
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
            summary: app.summaries.of_run(evaluation.run).await?,
            evaluation,
            result,
        })
    }

    fn played(&self, mismatch_seed: Seed) -> Played<'_> {
        Played {
            ruleset: &self.result.ruleset,
            profile: self.result.profile,
            variation: &self.result.variation,
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
/// `NotFound`, `Conflict` while one has no result, `Blind` and `NotYet` before their stage is opened and their day released,
/// `NotPaired` when they did not play the same episodes.
#[boxed]
pub async fn of(
    app: &AppState,
    sight: &Sight,
    [a, b]: [EvaluationId; 2],
    query: ComparisonQuery,
) -> Result<ComparisonView, Problem> {
    let (a, b) = (
        Side::load(app, sight, a).await?,
        Side::load(app, sight, b).await?,
    );
    let not_paired = |field: &str, detail: String| {
        Problem::new(
            ProblemKind::NotPaired,
            format!("{detail}; only evaluations that played the same episodes are compared"),
        )
        .with("field", field)
    };
    let (stage_a, stage_b) = (a.evaluation.of.stage, b.evaluation.of.stage);
    if stage_a != stage_b {
        return Err(not_paired(
            "stage",
            format!("stage: the first evaluation is of {stage_a}, the second of {stage_b}"),
        ));
    }
    let (day_a, day_b) = (a.evaluation.of.date, b.evaluation.of.date);
    if day_a != day_b {
        return Err(not_paired(
            "day",
            format!("day: the first evaluation is of {day_a}, the second of {day_b}"),
        ));
    }
    check_released(app, &a.evaluation).await?;
    for side in [&a, &b] {
        sight.check_not_frozen(&side.evaluation, "compared")?;
    }
    // that of the season, which both share
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let (played_a, played_b) = (a.played(mismatch_seed), b.played(mismatch_seed));
    let differs = |error: NotPaired| not_paired(error.field(), error.to_string());
    let Comparison { tasks, overall } = played_a.compare(&played_b).map_err(differs)?;
    let episodes = match query.episodes {
        true => Some(played_a.who_solved(&played_b).map_err(differs)?),
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

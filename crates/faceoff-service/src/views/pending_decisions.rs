//! What waits for a decision of the organisers: registrations, questions, results of closed stages, and evaluations without a result
//! through no fault of the agent.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_store::{Evaluation, EvaluationState, RegistrationState, StagePhase};
use faceoff_types::EvaluationId;
use std::{collections::BTreeSet, sync::Arc};

/// The number of pending decisions; `None` if the database cannot be read, which the page itself says.
#[boxed]
pub async fn count(app: &AppState) -> Option<usize> {
    let minute = app.config.clock.now().as_second() / 60;
    let key = (app.store.change_count(), minute);
    let counted = async { count_now(app).await.map(Arc::new).map_err(|_| ()) };
    let count = app.pending_decisions.get(key, counted).await;
    count.ok().map(|count| *count)
}

async fn count_now(app: &AppState) -> Result<usize, Problem> {
    let now = app.config.clock.now();
    let registrations = app.store.registrations().await?.into_iter();
    let registrations = registrations
        .filter(|registration| registration.state == RegistrationState::Pending)
        .count();
    let questions = app.store.questions().await?.into_iter();
    let questions = questions
        .filter(|question| question.answer.is_none())
        .count();
    let mut in_stages = 0;
    for stage in app.store.stages().await? {
        if stage.sign_off.is_some() {
            continue;
        }
        if stage.phase(now) == StagePhase::Closed {
            in_stages += 1;
        }
        if let Some(day) = app.store.newest_day(stage.id).await? {
            let evaluations = app.store.evaluations_of_day(day.stage_day).await?;
            in_stages += evaluations_to_repeat(&evaluations).count();
        }
    }
    Ok(registrations + questions + in_stages)
}

/// Evaluations of a day that have no result through no fault of the agent, and that nothing has replaced yet.
pub fn evaluations_to_repeat(evaluations: &[Evaluation]) -> impl Iterator<Item = &Evaluation> {
    let replaced: BTreeSet<EvaluationId> = evaluations
        .iter()
        .filter_map(|evaluation| evaluation.rerun_of)
        .collect();
    evaluations.iter().filter(move |evaluation| {
        let has_no_result = matches!(
            evaluation.state,
            EvaluationState::PlatformFailed { .. } | EvaluationState::NotPlayed { .. }
        );
        has_no_result && evaluation.voided.is_none() && !replaced.contains(&evaluation.id)
    })
}

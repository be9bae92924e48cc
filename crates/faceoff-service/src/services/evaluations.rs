//! Evaluation days and evaluations that an organiser starts, cancels or reruns. At the cutoff of an *evaluation day* the
//! server starts one *evaluation* for each team: it runs all tasks of the day with the team's active submission.

use super::decision_preview::{Preview, checked_reason, reason_sentence};
use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    views::{day, stage},
};
use faceoff_api::requests::NewExtraEvaluation;
use faceoff_store::{Actor, Evaluation, EvaluationState, Stage, StagePhase, StoreError};
use faceoff_types::{EvaluationId, StageDay, StageId, TeamId};
use jiff::Timestamp;

/// Starts the evaluation day of a stage, and returns it. `None`: of the open stage.
#[boxed_future]
pub async fn start_day(
    app: &AppState,
    actor: Actor,
    stage: Option<StageId>,
) -> Result<StageDay, Problem> {
    let now = app.config.clock.now();
    let stage = match stage {
        Some(id) => app.store.stage(id).await?,
        None => open_stage(app, now).await?,
    };
    match app.store.start_day(actor, stage.id, now).await {
        Ok(created) => tracing::info!(
            stage = %stage.name, evaluations = created.len(), "the day was started"
        ),
        Err(error) => return Err(start_problem(app, &stage, error).await?),
    }
    Ok(stage.day(now))
}

/// The open stage. If none is open, the nearest one in time: the store then refuses to start its day and says when it is open.
async fn open_stage(app: &AppState, now: Timestamp) -> Result<Stage, Problem> {
    let mut open_stages = app.store.stages().await?;
    open_stages.retain(|stage| stage.phase(now) == StagePhase::Open);
    if open_stages.len() > 1 {
        let names: Vec<String> = open_stages
            .iter()
            .map(|stage| format!("{} ({})", stage.name, stage.id))
            .collect();
        let detail = format!(
            "expected the stage whose day is to start, as several are open; name one of: {}",
            names.join(", ")
        );
        return Err(Problem::invalid("stage", detail));
    }
    stage::current(app).await
}

/// The problem of a day that cannot be started; if it has already had its cutoff, with the time of the next one.
async fn start_problem(
    app: &AppState,
    stage: &Stage,
    error: StoreError,
) -> Result<Problem, Problem> {
    let StoreError::CutoffPassed { day, cutoff_at } = error else {
        return Ok(error.into());
    };
    let next_cutoff = day::next_cutoff(app, stage).await?;
    let outlook = match &next_cutoff {
        Some(next) => {
            format!("The next cutoff evaluates the submissions that are active then: {next}")
        }
        None => "The stage has no further day".to_owned(),
    };
    let detail = format!(
        "{day} had its cutoff at {}, and a day has only one; nothing was started. {outlook}",
        cutoff_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    );
    let next_cutoff = serde_json::to_value(next_cutoff).map_err(Problem::internal)?;
    Ok(Problem::new(ProblemKind::CutoffPassed, detail)
        .with("day", day.to_string())
        .with_renamed("cutoff_at", "cut_at", cutoff_at.to_string())
        .with_renamed("next_cutoff", "next_cut", next_cutoff))
}

/// Starts a past day of a stage that had no cutoff, with the submissions that are active now.
#[boxed_future]
pub async fn start_missed_day(
    app: &AppState,
    actor: Actor,
    stage_day: StageDay,
    reason: &str,
) -> Result<(), Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let stage = app.store.stage(stage_day.stage).await?;
    let day = stage_day.date;
    match app
        .store
        .start_missed_day(actor, stage_day, reason, now)
        .await
    {
        Ok(created) => tracing::info!(
            stage = %stage.name, %day, evaluations = created.len(), reason, "a missed day was started"
        ),
        Err(error) => return Err(start_problem(app, &stage, error).await?),
    }
    Ok(())
}

/// Preview of an extra evaluation, which the organisers grant to one team for a day; `None` if it replaces no result that counts.
#[boxed_future]
pub async fn preview_extra_evaluation(
    app: &AppState,
    stage_day: StageDay,
    team: TeamId,
    reason: Option<&str>,
) -> Result<Option<Preview>, Problem> {
    let team = app.store.team(team).await?;
    let team_evaluations = app.store.evaluations_of(team.id).await?;
    let has_ended = |state: &EvaluationState| {
        matches!(
            state,
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. }
        )
    };
    let replaced = team_evaluations.iter().find(|evaluation| {
        evaluation.stage_day == stage_day
            && evaluation.voided.is_none()
            && has_ended(&evaluation.state)
    });
    Ok(replaced.map(|replaced| Preview {
        effect: format!(
            "the team {} has an evaluation of {} that counts ({}). It will be voided at once, and the team's active submission will be \
             evaluated in its place. {}",
            team.name,
            stage_day.date,
            replaced.id,
            reason_sentence(reason)
        ),
        name: team.name.to_string(),
    }))
}

/// Grants a team one more evaluation for a day.
#[boxed_future]
pub async fn grant_extra_evaluation(
    app: &AppState,
    actor: Actor,
    stage_day: StageDay,
    new: &NewExtraEvaluation,
) -> Result<Evaluation, Problem> {
    let reason = checked_reason(&new.reason)?;
    let team = new.team;
    let preview = preview_extra_evaluation(app, stage_day, team, Some(reason)).await?;
    if let Some(preview) = &preview {
        preview.check_confirmed(new.confirm.as_deref())?;
    }
    let now = app.config.clock.now();
    let extra = app
        .store
        .add_extra_evaluation(actor, stage_day, team, reason, preview.is_some(), now)
        .await?;
    tracing::info!(%team, day = %stage_day.date, evaluation = %extra.id, reason, "extra evaluation granted");
    Ok(extra)
}

/// Cancels an evaluation that has not ended.
#[boxed_future]
pub async fn cancel_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
    reason: &str,
) -> Result<Evaluation, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.cancel_evaluation(actor, id, reason, now).await?;
    tracing::info!(evaluation = %id, reason, "evaluation cancelled");
    Ok(app.store.evaluation(id).await?)
}

/// Reruns an evaluation; returns the new one.
#[boxed_future]
pub async fn rerun_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
) -> Result<Evaluation, Problem> {
    let now = app.config.clock.now();
    let rerun = app.store.rerun_evaluation(actor, id, now).await?;
    tracing::info!(evaluation = %id, rerun = %rerun.id, "evaluation is rerun");
    Ok(rerun)
}

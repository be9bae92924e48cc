//! Decisions of organisers about results, teams and the queue: voiding an evaluation or a day, pausing the queue, and
//! disqualifying a team. A *voided* evaluation no longer counts on any board.

use super::decision_preview::{Preview, checked_reason, count_text, reason_sentence};
use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{evaluation, visibility::Visibility},
};
use faceoff_api::requests::Decision;
use faceoff_store::{Actor, Evaluation, EvaluationState, Team};
use faceoff_types::{EvaluationId, StageDay, TeamId};

/// Preview of voiding an evaluation.
#[boxed_future]
pub async fn preview_void_evaluation(
    app: &AppState,
    id: EvaluationId,
    reason: Option<&str>,
) -> Result<Preview, Problem> {
    let visibility = Visibility::for_organiser(app).await?;
    let view = evaluation::find(app, &visibility, id).await?;
    let effect = format!(
        "the evaluation of {} by {} will disappear from the boards for good. It can be repeated. {}",
        view.day,
        view.team_name,
        reason_sentence(reason)
    );
    let name = view.team_name.to_string();
    Ok(Preview { name, effect })
}

/// Voids an evaluation, if that is confirmed with the team's name.
#[boxed_future]
pub async fn void_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
    decision: &Decision,
) -> Result<Evaluation, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let preview = preview_void_evaluation(app, id, Some(reason)).await?;
    preview.check_confirmed(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let voided = app.store.void_evaluation(actor, id, reason, now).await?;
    tracing::info!(evaluation = %id, reason, "evaluation voided");
    Ok(voided)
}

/// Preview of voiding a day.
#[boxed_future]
pub async fn preview_void_day(
    app: &AppState,
    stage_day: StageDay,
    reason: Option<&str>,
) -> Result<Preview, Problem> {
    let (mut ended_count, mut open_count) = (0, 0);
    for evaluation in app.store.evaluations_of_day(stage_day).await? {
        match evaluation.state {
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => {
                ended_count += u32::from(evaluation.voided.is_none());
            }
            state => open_count += u32::from(!state.is_over()),
        }
    }
    let cancelled = match open_count {
        0 => String::new(),
        open_count => format!(
            " {} will be cancelled.",
            count_text(open_count, "unfinished evaluation")
        ),
    };
    let effect = format!(
        "{} of {} will disappear from the boards for good.{cancelled} {}",
        count_text(ended_count, "evaluation"),
        stage_day.date,
        reason_sentence(reason)
    );
    let name = stage_day.date.to_string();
    Ok(Preview { name, effect })
}

/// Voids all evaluations of a day, if that is confirmed with the date.
#[boxed_future]
pub async fn void_day(
    app: &AppState,
    actor: Actor,
    stage_day: StageDay,
    decision: &Decision,
) -> Result<(), Problem> {
    let reason = checked_reason(&decision.reason)?;
    let preview = preview_void_day(app, stage_day, Some(reason)).await?;
    preview.check_confirmed(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let voided = app.store.void_day(actor, stage_day, reason, now).await?;
    tracing::info!(day = %stage_day, voided, reason, "day voided");
    Ok(())
}

/// Pauses the queue: no job starts.
#[boxed_future]
pub async fn pause_queue(app: &AppState, actor: Actor, reason: &str) -> Result<(), Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.pause_queue(actor, reason, now).await?;
    tracing::info!(reason, "queue paused");
    Ok(())
}

/// Resumes the queue.
#[boxed_future]
pub async fn resume_queue(app: &AppState, actor: Actor) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.resume_queue(actor, now).await?;
    tracing::info!("queue resumed");
    Ok(())
}

/// Preview of disqualifying a team.
#[boxed_future]
pub async fn preview_disqualification(
    app: &AppState,
    id: TeamId,
    reason: Option<&str>,
) -> Result<Preview, Problem> {
    let team = app.store.team(id).await?;
    let team_evaluations = app.store.evaluations_of(id).await?;
    let open = team_evaluations
        .iter()
        .filter(|evaluation| !evaluation.state.is_over());
    let open = match u32::try_from(open.count()).unwrap_or(u32::MAX) {
        0 => "It has no unfinished evaluations".to_owned(),
        open => format!(
            "{} will be cancelled",
            count_text(open, "unfinished evaluation")
        ),
    };
    let effect = format!(
        "the team {} will disappear from all boards, and can neither upload nor be evaluated until you reinstate it. {open}. {}",
        team.name,
        reason_sentence(reason)
    );
    let name = team.name.to_string();
    Ok(Preview { name, effect })
}

/// Disqualifies a team, if that is confirmed with the team's name.
#[boxed_future]
pub async fn disqualify_team(
    app: &AppState,
    actor: Actor,
    id: TeamId,
    decision: &Decision,
) -> Result<Team, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let preview = preview_disqualification(app, id, Some(reason)).await?;
    preview.check_confirmed(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let team = app.store.disqualify_team(actor, id, reason, now).await?;
    tracing::info!(team = %team.name, %id, reason, "team disqualified");
    Ok(team)
}

/// Lifts a team's disqualification.
#[boxed_future]
pub async fn reinstate_team(
    app: &AppState,
    actor: Actor,
    id: TeamId,
    reason: &str,
) -> Result<Team, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let team = app.store.reinstate_team(actor, id, reason, now).await?;
    tracing::info!(team = %team.name, %id, reason, "team reinstated");
    Ok(team)
}

//! Decisions against results and teams, and over the queue.

use super::deciding::{Stake, checked_reason, published};
use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{day, evaluation, sight::Sight, team},
};
use faceoff_api::{
    requests::Decision,
    views::{day::DayView, evaluation::EvaluationView, team::TeamView},
};
use faceoff_store::{Actor, EvaluationState};
use faceoff_types::{EvaluationId, StageDay, TeamId};

/// What the voiding of an evaluation would do.
#[boxed]
pub async fn at_stake_of_evaluation(
    app: &AppState,
    id: EvaluationId,
    reason: Option<&str>,
) -> Result<Stake, Problem> {
    let sight = Sight::of_organiser(app).await?;
    let view = evaluation::find(app, &sight, id).await?;
    let what = format!(
        "the evaluation of {} by {} would leave the boards for good, {}; it can be played again (rerun)",
        view.day,
        view.team_name,
        published(reason)
    );
    let name = view.team_name.to_string();
    Ok(Stake { name, what })
}

/// Takes an evaluation out of the boards, once that is confirmed.
#[boxed]
pub async fn void_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
    decision: &Decision,
) -> Result<EvaluationView, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let stake = at_stake_of_evaluation(app, id, Some(reason)).await?;
    stake.check(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let voided = app.store.void_evaluation(actor, id, reason, now).await?;
    tracing::info!(evaluation = %id, reason, "evaluation voided");
    let sight = Sight::of_organiser(app).await?;
    evaluation::of(app, &sight, voided).await
}

/// What the voiding of a day would do.
#[boxed]
pub async fn at_stake_of_day(
    app: &AppState,
    of: StageDay,
    reason: Option<&str>,
) -> Result<Stake, Problem> {
    let (mut ended, mut open) = (0, 0);
    for evaluation in app.store.evaluations_of_day(of).await? {
        match evaluation.state {
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => {
                ended += u32::from(evaluation.voided.is_none());
            }
            state => open += u32::from(!state.is_over()),
        }
    }
    let what = format!(
        "{ended} evaluations of {} would leave the boards for good and {open} that are under way be cancelled, {}",
        of.date,
        published(reason)
    );
    let name = of.date.to_string();
    Ok(Stake { name, what })
}

/// Takes all evaluations of a day out of the boards, once that is confirmed.
#[boxed]
pub async fn void_day(
    app: &AppState,
    actor: Actor,
    of: StageDay,
    decision: &Decision,
) -> Result<DayView, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let stake = at_stake_of_day(app, of, Some(reason)).await?;
    stake.check(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let voided = app.store.void_day(actor, of, reason, now).await?;
    tracing::info!(day = %of, voided, reason, "day voided");
    day::of(app, of).await
}

/// Holds the queue: nothing new is begun.
#[boxed]
pub async fn pause_queue(app: &AppState, actor: Actor, reason: &str) -> Result<(), Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.pause_queue(actor, reason, now).await?;
    tracing::info!(reason, "queue paused");
    Ok(())
}

/// Lets the queue go on.
#[boxed]
pub async fn resume_queue(app: &AppState, actor: Actor) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.resume_queue(actor, now).await?;
    tracing::info!("queue resumed");
    Ok(())
}

/// What the disqualification of a team would do.
#[boxed]
pub async fn at_stake_of_team(
    app: &AppState,
    id: TeamId,
    reason: Option<&str>,
) -> Result<Stake, Problem> {
    let team = app.store.team(id).await?;
    let own = app.store.evaluations_of(id).await?;
    let open = own.iter().filter(|evaluation| !evaluation.state.is_over());
    let what = format!(
        "{} would leave all boards, {} of its evaluations that are under way be cancelled, and it would neither upload \
         nor play, {}, until it is reinstated",
        team.name,
        open.count(),
        published(reason)
    );
    let name = team.name.to_string();
    Ok(Stake { name, what })
}

/// Disqualifies a team, once that is confirmed.
#[boxed]
pub async fn disqualify_team(
    app: &AppState,
    actor: Actor,
    id: TeamId,
    decision: &Decision,
) -> Result<TeamView, Problem> {
    let reason = checked_reason(&decision.reason)?;
    let stake = at_stake_of_team(app, id, Some(reason)).await?;
    stake.check(decision.confirm.as_deref())?;
    let now = app.config.clock.now();
    let team = app.store.disqualify_team(actor, id, reason, now).await?;
    tracing::info!(team = %team.name, %id, reason, "team disqualified");
    Ok(team::of(team))
}

/// Takes a disqualification back.
#[boxed]
pub async fn reinstate_team(
    app: &AppState,
    actor: Actor,
    id: TeamId,
    reason: &str,
) -> Result<TeamView, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let team = app.store.reinstate_team(actor, id, reason, now).await?;
    tracing::info!(team = %team.name, %id, reason, "team reinstated");
    Ok(team::of(team))
}

//! Days and turns that an organiser starts, stops and has played again.

use super::deciding::{Stake, checked_reason, published};
use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    views::{day, evaluation, sight::Sight, stage},
};
use faceoff_api::{
    requests::ExtraTurn,
    views::{day::DayView, evaluation::EvaluationView},
};
use faceoff_store::{Actor, EvaluationState, Stage, StagePhase, StoreError};
use faceoff_types::{EvaluationId, StageDay, StageId, TeamId};
use jiff::{Timestamp, civil::Date};

/// Starts a stage's day; of the open stage, if none is named.
#[boxed]
pub async fn start_day(
    app: &AppState,
    actor: Actor,
    stage: Option<StageId>,
) -> Result<DayView, Problem> {
    let now = app.config.clock.now();
    let stage = match stage {
        Some(id) => app.store.stage(id).await?,
        None => the_open_one(app, now).await?,
    };
    match app.store.start_day(actor, stage.id, now).await {
        Ok(created) => tracing::info!(
            stage = %stage.name, evaluations = created.len(), "the day was started"
        ),
        Err(StoreError::DayHasCut { day, cut_at }) => {
            return Err(had_its_cut(app, &stage, day, cut_at).await?);
        }
        Err(error) => return Err(error.into()),
    }
    day::of(app, stage.day(now)).await
}

/// The stage that is open. Where none is, the nearest, whose refusal tells when it is.
async fn the_open_one(app: &AppState, now: Timestamp) -> Result<Stage, Problem> {
    let mut open = app.store.stages().await?;
    open.retain(|stage| stage.phase(now) == StagePhase::Open);
    if open.len() > 1 {
        let names: Vec<String> = open
            .iter()
            .map(|stage| format!("{} ({})", stage.name, stage.id))
            .collect();
        let detail = format!(
            "several stages are open, so name the one whose day is to start: {}",
            names.join(", ")
        );
        return Err(Problem::invalid("stage", detail));
    }
    stage::current(app).await
}

async fn had_its_cut(
    app: &AppState,
    stage: &Stage,
    day: Date,
    cut_at: Timestamp,
) -> Result<Problem, Problem> {
    let next = day::next_cut(app, stage).await?;
    let when = match &next {
        Some(next) => {
            format!("What the teams have active at the next cut plays the next day: {next}")
        }
        None => "The stage has no other day".to_owned(),
    };
    let detail = format!(
        "{day} had its cut at {}, and a day has one; nothing was started. {when}",
        cut_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    );
    let next = serde_json::to_value(next).map_err(Problem::internal)?;
    Ok(Problem::new(ProblemKind::DayHasCut, detail)
        .with("day", day.to_string())
        .with("cut_at", cut_at.to_string())
        .with("next_cut", next))
}

/// Plays a day of a stage that was missed.
#[boxed]
pub async fn start_missed_day(
    app: &AppState,
    actor: Actor,
    of: StageDay,
    reason: &str,
) -> Result<DayView, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let stage = app.store.stage(of.stage).await?;
    let day = of.date;
    match app.store.start_missed_day(actor, of, reason, now).await {
        Ok(created) => tracing::info!(
            stage = %stage.name, %day, evaluations = created.len(), reason, "a missed day was started"
        ),
        Err(StoreError::DayHasCut { day, cut_at }) => {
            return Err(had_its_cut(app, &stage, day, cut_at).await?);
        }
        Err(error) => return Err(error.into()),
    }
    day::of(app, of).await
}

/// What an extra turn would take away: a result that counts, if there is one.
#[boxed]
pub async fn at_stake_of_turn(
    app: &AppState,
    of: StageDay,
    team: TeamId,
    reason: Option<&str>,
) -> Result<Option<Stake>, Problem> {
    let team = app.store.team(team).await?;
    let own = app.store.evaluations_of(team.id).await?;
    let ended = |state: &EvaluationState| {
        matches!(
            state,
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. }
        )
    };
    let replaced = own
        .iter()
        .find(|one| one.of == of && one.voided.is_none() && ended(&one.state));
    Ok(replaced.map(|replaced| Stake {
        what: format!(
            "{} has an evaluation of {} that counts ({}). It would be voided at once, {}, and what the team has active \
             now would play in its place",
            team.name,
            of.date,
            replaced.id,
            published(reason)
        ),
        name: team.name.to_string(),
    }))
}

/// Gives one team one more evaluation of a day.
#[boxed]
pub async fn extra_turn(
    app: &AppState,
    actor: Actor,
    of: StageDay,
    wanted: &ExtraTurn,
) -> Result<EvaluationView, Problem> {
    let reason = checked_reason(&wanted.reason)?;
    let team = wanted.team;
    let stake = at_stake_of_turn(app, of, team, Some(reason)).await?;
    if let Some(stake) = &stake {
        stake.check(wanted.confirm.as_deref())?;
    }
    let now = app.config.clock.now();
    let turn = app
        .store
        .extra_turn(actor, of, team, reason, stake.is_some(), now)
        .await?;
    tracing::info!(%team, day = %of.date, evaluation = %turn.id, reason, "an extra turn was given");
    evaluation::of(app, &Sight::of_organiser(app).await?, turn).await
}

/// Stops an evaluation that is not over.
#[boxed]
pub async fn cancel_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
    reason: &str,
) -> Result<EvaluationView, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.cancel_evaluation(actor, id, reason, now).await?;
    tracing::info!(evaluation = %id, reason, "evaluation cancelled");
    let sight = Sight::of_organiser(app).await?;
    evaluation::find(app, &sight, id).await
}

/// Plays an evaluation again; the one that does.
#[boxed]
pub async fn rerun_evaluation(
    app: &AppState,
    actor: Actor,
    id: EvaluationId,
) -> Result<EvaluationView, Problem> {
    let now = app.config.clock.now();
    let rerun = app.store.rerun_evaluation(actor, id, now).await?;
    tracing::info!(evaluation = %id, rerun = %rerun.id, "an evaluation is played again");
    let sight = Sight::of_organiser(app).await?;
    evaluation::of(app, &sight, rerun).await
}

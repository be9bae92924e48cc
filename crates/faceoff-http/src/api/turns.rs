//! Turns beside the schedule's: a day that was missed, and one more evaluation for one team.

use super::{days::had_its_cut, rulings::checked_reason};
use crate::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, PathParams},
    paths,
    problem::Problem,
    requests::{Decision, ExtraTurn, MissedDay},
    views::{day::DayView, evaluation::EvaluationView, sight::Sight},
};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_store::{EvaluationState, StoreError};
use faceoff_types::{StageDay, StageId};

/// Plays a day that was missed: a date of the stage that has passed without a cut. What each team has active now
/// plays it, on the episodes of that date.
#[utoipa::path(
    post, path = "/stages/{id}/days", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = MissedDay,
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cut, the date has not passed or is none of the stage's, the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_missed_day(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(MissedDay { day, reason }): Body<MissedDay>,
) -> Result<Json<DayView>, Problem> {
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    let stage = app.store.stage(id).await?;
    let of = StageDay {
        stage: id,
        date: day,
    };
    let started = app
        .store
        .start_missed_day(organiser.actor(), of, reason, now)
        .await;
    match started {
        Ok(created) => tracing::info!(
            stage = %stage.name, %day, evaluations = created.len(), reason, "a missed day was started"
        ),
        Err(StoreError::DayHasCut { day, cut_at }) => {
            return Err(had_its_cut(&app, &stage, day, cut_at).await?);
        }
        Err(error) => return Err(error.into()),
    }
    DayView::of(&app, of).await.map(Json)
}

/// Gives one team one more evaluation of a day that has had its cut, with what it has active now.
///
/// While the day is under way it plays the day's episodes. Once that is released it plays episodes of its own, since
/// the day's are public; its row says so, and is not compared episode by episode.
#[utoipa::path(
    post, path = "/stages/{id}/days/{day}/extra-turn", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path), ("day" = Date, Path, example = "2026-03-01")), request_body = ExtraTurn,
    responses(
        (status = 201, body = EvaluationView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 403, description = "the team is disqualified"),
        (status = 404),
        (status = 409, description = "a result that counts would be replaced, and the team's name does not confirm it (nothing is done); one is under way; the team has nothing active; the stage is not open, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn extra_turn(
    organiser: Organiser,
    State(app): State<App>,
    day: PathParams<String, 2>,
    Body(wanted): Body<ExtraTurn>,
) -> Result<impl IntoResponse, Problem> {
    let PathParams([stage, day]) = day;
    let of: StageDay = format!("{stage}/{day}")
        .parse()
        .map_err(|_| Problem::not_found("day"))?;
    let reason = checked_reason(&wanted.reason)?;
    let team = app.store.team(wanted.team).await?;
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
    if let Some(replaced) = replaced {
        let decision = Decision {
            reason: reason.to_owned(),
            confirm: wanted.confirm,
        };
        let what = format!(
            "{} has an evaluation of {} that counts ({}). It would be voided at once, with the reason {reason:?} for \
             everybody to read, and what the team has active now would play in its place",
            team.name, of.date, replaced.id
        );
        Problem::check_confirmed(decision.confirm.as_deref(), team.name.as_str(), &what)?;
    }
    let now = app.config.clock.now();
    let turn = app
        .store
        .extra_turn(
            organiser.actor(),
            of,
            team.id,
            reason,
            replaced.is_some(),
            now,
        )
        .await?;
    tracing::info!(team = %team.name, day = %of.date, evaluation = %turn.id, reason, "an extra turn was given");
    let view = EvaluationView::of(&app, &Sight::of_organiser(&app).await?, turn).await?;
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

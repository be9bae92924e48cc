//! Evaluation days and cutoffs. At the *cutoff* of a day the server starts one evaluation of each team's active submission.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{evaluation, exclusions, team, visibility::Visibility},
};
use faceoff_api::views::day::{DayView, NextCutoff};
use faceoff_store::Stage;
use faceoff_types::{StageDay, TeamId};
use jiff::Timestamp;
use std::collections::BTreeSet;

/// An evaluation day with its evaluations, for organisers.
#[boxed_future]
pub async fn build(app: &AppState, stage_day: StageDay) -> Result<DayView, Problem> {
    let visibility = Visibility::for_organiser(app).await?;
    let mut evaluations = evaluation::day_evaluations(app, &visibility, stage_day).await?;
    evaluation::add_queue_positions(app, &mut evaluations).await?;
    let evaluated: BTreeSet<TeamId> = evaluations
        .iter()
        .map(|evaluation| evaluation.team)
        .collect();
    let mut without_submission = team::all(app).await?;
    let mut excluded_teams =
        exclusions::excluded_teams(app, &app.store.stage(stage_day.stage).await?).await?;
    excluded_teams.retain(|excluded| !evaluated.contains(&excluded.team));
    let is_excluded = |id| excluded_teams.iter().any(|excluded| excluded.team == id);
    without_submission.retain(|team| !evaluated.contains(&team.id) && !is_excluded(team.id));
    Ok(DayView {
        stage: stage_day.stage,
        day: stage_day.date,
        evaluations,
        without_submission,
        excluded: excluded_teams,
    })
}

/// The next cutoff of a stage; `None` if it has no further day, or the season is closed.
#[boxed_future]
pub async fn next_cutoff(app: &AppState, stage: &Stage) -> Result<Option<NextCutoff>, Problem> {
    if app.store.season().await?.closed_at.is_some() {
        return Ok(None);
    }
    let now = app.config.clock.now();
    let next = app.store.next_cutoff(stage, now).await?;
    Ok(next.map(|(day, at)| NextCutoff {
        stage: stage.id,
        stage_name: stage.name.clone(),
        day,
        at,
        zone: stage.zone.clone(),
    }))
}

/// The earliest of the next cutoffs of all stages; `None` if no stage has a further day, or the season is closed.
pub(crate) async fn first_cutoff(app: &AppState) -> Result<Option<NextCutoff>, Problem> {
    let mut first: Option<(Timestamp, NextCutoff)> = None;
    for stage in app.store.stages().await? {
        let Some(next) = next_cutoff(app, &stage).await? else {
            continue;
        };
        // Without a schedule, an organiser starts the day at any time from its beginning on.
        let day_start = next.day.to_zoned(stage.zone.time_zone());
        let day_start = day_start.map_err(Problem::internal)?.timestamp();
        let cutoff_at = next.at.unwrap_or(day_start);
        if first
            .as_ref()
            .is_none_or(|(earliest, _)| cutoff_at < *earliest)
        {
            first = Some((cutoff_at, next));
        }
    }
    Ok(first.map(|(_, next)| next))
}

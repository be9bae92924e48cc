//! The day's cut: what it brought about, and when the next one is.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{evaluation, not_taken, sight::Sight, team},
};
use faceoff_api::views::day::{DayView, NextCut};
use faceoff_store::Stage;
use faceoff_types::{StageDay, TeamId};
use jiff::Timestamp;
use std::collections::BTreeSet;

/// What has become of a day.
#[boxed]
pub async fn of(app: &AppState, of: StageDay) -> Result<DayView, Problem> {
    let sight = Sight::of_organiser(app).await?;
    let mut created = evaluation::of_day(app, &sight, of).await?;
    evaluation::place(app, &mut created).await?;
    let evaluated: BTreeSet<TeamId> = created.iter().map(|created| created.team).collect();
    let mut without_submission = team::all(app).await?;
    let mut not_taken = not_taken::by(app, &app.store.stage(of.stage).await?).await?;
    not_taken.retain(|left_out| !evaluated.contains(&left_out.team));
    let is_left_out = |id| not_taken.iter().any(|left_out| left_out.team == id);
    without_submission.retain(|team| !evaluated.contains(&team.id) && !is_left_out(team.id));
    Ok(DayView {
        stage: of.stage,
        day: of.date,
        created,
        without_submission,
        not_taken,
    })
}

/// Of a stage; `None` if it has no other day, or the season is closed.
#[boxed]
pub async fn next_cut(app: &AppState, stage: &Stage) -> Result<Option<NextCut>, Problem> {
    if app.store.season().await?.closed_at.is_some() {
        return Ok(None);
    }
    let newest = app.store.newest_day(stage.id).await?;
    let next = stage.next_cut(newest.map(|day| day.of.date), app.config.clock.now());
    Ok(next.map(|(day, at)| NextCut {
        stage: stage.id,
        stage_name: stage.name.clone(),
        day,
        at,
        zone: stage.zone.clone(),
    }))
}

/// The first of all stages; `None` if none has another day, or the season is closed.
pub(crate) async fn first_cut(app: &AppState) -> Result<Option<NextCut>, Problem> {
    let mut first: Option<(Timestamp, NextCut)> = None;
    for stage in app.store.stages().await? {
        let Some(next) = next_cut(app, &stage).await? else {
            continue;
        };
        let begins = next.day.to_zoned(stage.zone.time_zone());
        let begins = begins.map_err(Problem::internal)?.timestamp();
        let at = next.at.unwrap_or(begins);
        if first.as_ref().is_none_or(|(earliest, _)| at < *earliest) {
            first = Some((at, next));
        }
    }
    Ok(first.map(|(_, next)| next))
}

//! The season: its stages, evaluation days and seeds. All seeds derive from the season's secret, which is published at the end; its
//! hash, the *commitment*, is public from the start, so that everyone can check the seeds.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    viewer::Viewer,
    views::{archive, day, decision, stage, visibility::Visibility},
};
use faceoff_api::views::{
    decision::DecisionView,
    season::{SeasonDay, SeasonView},
};
use faceoff_types::{Seed, StageDay};
use std::{collections::HashMap, sync::atomic::Ordering};

/// The season, as the viewer may see it.
#[boxed_future]
pub async fn build(app: &AppState, viewer: Viewer) -> Result<SeasonView, Problem> {
    let season = app.store.season().await?;
    update_has_tournaments(app).await?;
    let visibility = Visibility::load(app, viewer).await?;
    let days = app.store.days().await?;
    let missed_reasons: HashMap<StageDay, String> =
        app.store.missed_days().await?.into_iter().collect();
    let stages = app.store.stages().await?;
    let seeds = app
        .store
        .day_seeds(&season, &stages, days.iter().map(|(day, _)| day.stage_day))
        .await?;
    let reveal_if_closed = |seed: Seed| season.closed_at.map(|_| seed);
    Ok(SeasonView {
        ruleset: app.config.competition().ruleset().to_string(),
        created_at: season.created_at,
        closed_at: season.closed_at,
        paused: season.queue_pause.map(decision::view),
        archived: app.store.archived_season().map(archive::view),
        takes_registrations: season.registration_open,
        divisions: app.store.divisions().await?,
        terms_version: app.store.terms().await?.first().map(|terms| terms.version),
        secret: reveal_if_closed(season.secret),
        mismatch_seed: reveal_if_closed(season.secret.model_mismatch()),
        today: stage::current(app).await?.day(app.config.clock.now()).date,
        stages: stage::all_for_viewer(app, viewer).await?,
        next_cutoff: day::first_cutoff(app).await?,
        days: days
            .into_iter()
            .map(|(day, finished)| SeasonDay {
                stage: day.stage_day.stage,
                day: day.stage_day.date,
                cutoff_at: day.cutoff_at,
                deadline_at: day.deadline_at,
                released_at: day.released_at,
                missed: missed_reasons.get(&day.stage_day).cloned(),
                finished,
                seed: day
                    .released_at
                    .filter(|_| !visibility.hides_scores(day.stage_day.stage))
                    .and_then(|_| seeds.get(&day.stage_day).copied()),
            })
            .collect(),
        name: season.name,
        commitment: season.commitment,
    })
}

/// The season's data in page headers. Loading it is one database read, however many days the season has.
pub struct SeasonSummary {
    pub name: String,
    /// Hash of the season secret, in hexadecimal digits.
    pub commitment: String,
    /// If an organiser paused the queue: since when, and why.
    pub paused: Option<DecisionView>,
    /// Whether teams can register now.
    pub takes_registrations: bool,
}

impl SeasonSummary {
    /// The current data.
    #[boxed_future]
    pub async fn load(app: &AppState) -> Result<Self, Problem> {
        let season = app.store.season().await?;
        update_has_tournaments(app).await?;
        Ok(Self {
            takes_registrations: season.registration_open && season.closed_at.is_none(),
            name: season.name,
            commitment: season.commitment,
            paused: season.queue_pause.map(decision::view),
        })
    }
}

/// Updates the flag that the season has a tournament: pages link to tournaments once there is one.
async fn update_has_tournaments(app: &AppState) -> Result<(), Problem> {
    if !app.has_tournaments.load(Ordering::Relaxed) && !app.store.tournaments().await?.is_empty() {
        app.has_tournaments.store(true, Ordering::Relaxed);
    }
    Ok(())
}

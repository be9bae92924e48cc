//! The season's commitment, and what may be known of its seeds.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    viewer::Viewer,
    views::{archived, day, ruling, sight::Sight, stage},
};
use faceoff_api::views::{
    ruling::RulingView,
    season::{SeasonDay, SeasonView},
};
use faceoff_types::{RULESET, Seed, StageDay};
use std::{collections::HashMap, sync::atomic::Ordering};

/// The season as the viewer sees it.
#[boxed]
pub async fn now(app: &AppState, viewer: Viewer) -> Result<SeasonView, Problem> {
    let season = app.store.season().await?;
    look_for_tournaments(app).await?;
    let sight = Sight::of(app, viewer).await?;
    let days = app.store.days().await?;
    let missed: HashMap<StageDay, String> = app.store.missed_days().await?.into_iter().collect();
    let stages = app.store.stages().await?;
    let seeds = app
        .store
        .day_seeds(&season, &stages, days.iter().map(|(day, _)| day.of))
        .await?;
    let revealed = |seed: Seed| season.closed_at.map(|_| seed);
    Ok(SeasonView {
        ruleset: RULESET.to_owned(),
        created_at: season.created_at,
        closed_at: season.closed_at,
        paused: season.paused.map(ruling::of),
        archived: app.store.archived().map(archived::of),
        takes_registrations: season.takes_registrations,
        divisions: app.store.divisions().await?,
        terms_version: app.store.terms().await?.first().map(|terms| terms.version),
        secret: revealed(season.secret),
        mismatch_seed: revealed(season.secret.model_mismatch()),
        today: stage::current(app).await?.day(app.config.clock.now()).date,
        stages: stage::all_seen_by(app, viewer).await?,
        next_cut: day::first_cut(app).await?,
        days: days
            .into_iter()
            .map(|(day, finished)| SeasonDay {
                stage: day.of.stage,
                day: day.of.date,
                cut_at: day.cut_at,
                deadline_at: day.deadline_at,
                released_at: day.released_at,
                missed: missed.get(&day.of).cloned(),
                finished,
                seed: day
                    .released_at
                    .filter(|_| !sight.is_hidden(day.of.stage))
                    .and_then(|_| seeds.get(&day.of).copied()),
            })
            .collect(),
        name: season.name,
        commitment: season.commitment,
    })
}

/// What the heads of pages tell of the season: one read, however long the season is.
pub struct SeasonHead {
    /// As the organiser named it.
    pub name: String,
    /// The hash of its secret, in hexadecimal digits.
    pub commitment: String,
    /// The organiser holds the queue: since when, and why.
    pub paused: Option<RulingView>,
}

impl SeasonHead {
    /// As it is now.
    #[boxed]
    pub async fn now(app: &AppState) -> Result<Self, Problem> {
        let season = app.store.season().await?;
        look_for_tournaments(app).await?;
        Ok(Self {
            name: season.name,
            commitment: season.commitment,
            paused: season.paused.map(ruling::of),
        })
    }
}

/// Pages lead to tournaments once there is one.
async fn look_for_tournaments(app: &AppState) -> Result<(), Problem> {
    if !app.has_tournaments.load(Ordering::Relaxed) && !app.store.tournaments().await?.is_empty() {
        app.has_tournaments.store(true, Ordering::Relaxed);
    }
    Ok(())
}

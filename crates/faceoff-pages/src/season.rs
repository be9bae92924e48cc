//! `/season`: stages, evaluation days and seeds. All seeds derive from one secret. The page has everything to verify them: the
//! *commitment* (the hash of the secret, public from the start), the secret once it is public, and the derivation.

use super::frame::{Frame, PageProblem, render};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{
    capacity::{DayLoad, Fit},
    season::SeasonView,
    stage::StageView,
};
use faceoff_service::{app::App, problem::Problem, viewer::Viewer, views::season};
use faceoff_types::{Competition, StageId, StageName, Task, TournamentId};
use jiff::Timestamp;
use std::sync::Arc;

#[derive(Template)]
#[template(path = "season.html")]
struct Page {
    frame: Frame,
    season: SeasonView,
    opened: String,
    closed: Option<String>,
    tournaments: Vec<(TournamentId, StageName)>,
    competition: Arc<Competition>,
}

impl Page {
    /// Names of the tasks, each with the text that joins it to the one before: nothing, a comma, or “or”.
    fn tasks_of_seeds(&self) -> Vec<(&'static str, Task)> {
        let last = self.competition.tasks.len().saturating_sub(1);
        let with_separator = |(index, task)| match index {
            0 => ("", task),
            _ if index == last => (" or ", task),
            _ => (", ", task),
        };
        self.competition
            .task_names()
            .enumerate()
            .map(with_separator)
            .collect()
    }

    fn local_time(&self, stage: &StageView, instant: &Timestamp) -> String {
        let local = instant.to_zoned(stage.zone.time_zone());
        format!("{} {}", local.strftime("%Y-%m-%d %H:%M:%S"), stage.zone)
    }

    fn stage_name(&self, id: &StageId) -> String {
        let stage = self.season.stages.iter().find(|stage| stage.id == *id);
        stage.map_or_else(|| id.to_string(), |stage| stage.name.to_string())
    }

    /// For each coming evaluation day: the name of its stage, and an estimate of when its evaluations end; organisers only.
    fn capacity_forecasts(&self) -> Vec<(&str, &DayLoad)> {
        let stages = self.season.stages.iter();
        stages
            .flat_map(|stage| {
                let forecasts = stage.capacity.iter().flatten();
                forecasts.map(|forecast| (stage.name.as_str(), forecast))
            })
            .collect()
    }

    /// The name of a stage that an older version created: its id is not part of its seeds.
    fn stage_without_seed(&self) -> Option<&str> {
        let stage = self.season.stages.iter().find(|stage| !stage.names_seeds);
        stage.map(|stage| stage.name.as_str())
    }

    /// Id of a stage as hexadecimal digits, for the example.
    fn example_stage(&self) -> String {
        let stage = self.season.stages.iter().find(|stage| stage.names_seeds);
        stage.map_or_else(
            || "STAGE".to_owned(),
            |stage| stage.id.as_uuid().simple().to_string(),
        )
    }
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
) -> Result<Response, PageProblem> {
    let season = season::build(&app, viewer?).await?;
    let utc_second = |instant: Timestamp| instant.strftime("%Y-%m-%d %H:%M:%S UTC").to_string();
    let tournaments = app.store.tournaments().await?;
    render(&Page {
        tournaments: tournaments
            .into_iter()
            .map(|tournament| (tournament.id, tournament.name))
            .collect(),
        frame: Frame::for_app(&app, season.name.clone(), "/season"),
        competition: Arc::clone(app.config.competition()),
        opened: utc_second(season.created_at),
        closed: season.closed_at.map(utc_second),
        season,
    })
}

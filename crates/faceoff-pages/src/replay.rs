//! `/evaluations/{id}/episodes/{task}/{episode}`: an episode, drawn; and the same without anything around it, for other sites.

use super::{
    assets,
    episode_words::in_words,
    frame::{Frame, PageProblem, render},
    replay_section::ReplaySection,
};
use crate::embeddable::Embeddable;
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::paths;
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_service::{
    app::App,
    episode_path::EpisodePath,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, season::SeasonHead, sight::Sight},
};
use faceoff_types::{EvaluationId, Task};
use jiff::civil::Date;

/// What both pages need.
struct Shown {
    id: EvaluationId,
    task: Task,
    episode: u32,
    team: String,
    day: Date,
    success: bool,
    why: String,
    broken: Vec<String>,
    late: u32,
    duration_s: String,
    replay: ReplaySection,
    script: &'static str,
    styles: [&'static str; 2],
    before: Option<String>,
    after: Option<String>,
}

#[derive(Template)]
#[template(path = "replay.html")]
struct Page {
    frame: Frame,
    shown: Shown,
}

#[derive(Template)]
#[template(path = "replay_embedded.html")]
struct Embedded {
    frame: Frame,
    shown: Shown,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<EpisodePath, Problem>,
) -> Result<Response, PageProblem> {
    let shown = Shown::of(&app, viewer?, path?).await?;
    let season = SeasonHead::now(&app).await?;
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        shown,
    })
}

/// The replay alone, as anybody sees it, whoever is signed in: pages of other sites may hold it.
pub(super) async fn embedded(
    State(app): State<App>,
    path: Result<EpisodePath, Problem>,
) -> Result<Response, PageProblem> {
    let shown = Shown::of(&app, Viewer::Anybody, path?).await?;
    let mut answer = render(&Embedded {
        frame: Frame::new(String::new(), ""),
        shown: Shown {
            replay: ReplaySection {
                observed: None,
                is_embedded: true,
                ..shown.replay
            },
            ..shown
        },
    })?;
    answer.extensions_mut().insert(Embeddable);
    Ok(answer)
}

impl Shown {
    async fn of(app: &App, viewer: Viewer, path: EpisodePath) -> Result<Self, Problem> {
        let EpisodePath { id, task, episode } = path;
        let sight = Sight::of(app, viewer).await?;
        let clips = Clips::of(app, &sight, id).await?;
        let shown = clips.episode(task, episode).await?;
        let line = &shown.line;
        let team = app.store.team(clips.evaluation.team).await?;
        let day = clips.evaluation.of.date;
        let api = format!("{}/episodes/{task}/{episode}", paths::evaluation(id));
        Ok(Self {
            id,
            task,
            episode,
            team: team.name.to_string(),
            day,
            success: line.success,
            why: line.why.clone(),
            broken: line.broken.iter().map(in_words).collect(),
            late: line.late,
            duration_s: format!("{:.2}", f64::from(line.steps) * CONTROL_STEP_S),
            replay: ReplaySection::of(
                &shown,
                &api,
                format!("{task}, episode {episode}, {}", team.name),
                format!("{}, {task} {episode}, {day}", team.name),
            ),
            script: assets::REPLAY_SCRIPT.url(),
            styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
            before: shown.has_before.then(|| page_path(id, task, episode - 1)),
            after: shown.has_after.then(|| page_path(id, task, episode + 1)),
        })
    }
}

pub(super) fn page_path(id: EvaluationId, task: Task, episode: u32) -> String {
    format!("/evaluations/{id}/episodes/{task}/{episode}")
}

//! `/evaluations/{id}/episodes/{task}/{episode}`: the replay of an episode; and the replay alone, to embed in other sites.

use super::{
    assets,
    episode_text::describe_violation,
    frame::{Frame, NO_ENTRY, PageProblem, render},
    replay_section::ReplaySection,
    side_by_side::neighbours,
};
use crate::embeddable::Embeddable;
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::paths;
use faceoff_service::{
    app::App,
    episode_path::EpisodePath,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, visibility::Visibility},
};
use faceoff_types::{EvaluationId, Task};
use jiff::civil::Date;

/// Content of both pages.
struct EpisodeReplay {
    id: EvaluationId,
    task: Task,
    episode: u32,
    team: String,
    day: Date,
    /// What the agent has to achieve in the task.
    aim: String,
    success: bool,
    violations: Vec<String>,
    late_answers: u32,
    duration_s: String,
    replay: ReplaySection,
    script: &'static str,
    styles: [&'static str; 2],
    previous: Option<String>,
    next: Option<String>,
    failed: FailedEpisodes,
}

/// The failed episodes of the task in this evaluation.
struct FailedEpisodes {
    count: usize,
    /// The place of this episode among them, from 1; `None` if it was a success.
    place: Option<usize>,
    previous: Option<String>,
    next: Option<String>,
}

#[derive(Template)]
#[template(path = "replay.html")]
struct Page {
    frame: Frame,
    view: EpisodeReplay,
}

#[derive(Template)]
#[template(path = "replay_embedded.html")]
struct EmbeddedPage {
    frame: Frame,
    view: EpisodeReplay,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<EpisodePath, Problem>,
) -> Result<Response, PageProblem> {
    let view = EpisodeReplay::load(&app, viewer?, path?).await?;
    let own_path = page_path(view.id, view.task, view.episode);
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY)
            .await?
            .with_address(&app, &own_path)
            .with_card(
                &app,
                &format!("{own_path}/card.png"),
                format!("The episode from above. {}", view.replay.outcome),
            ),
        view,
    })
}

/// The replay alone, for other sites: always the public view, whether or not the visitor is signed in.
pub(super) async fn embedded(
    State(app): State<App>,
    path: Result<EpisodePath, Problem>,
) -> Result<Response, PageProblem> {
    let view = EpisodeReplay::load(&app, Viewer::Visitor, path?).await?;
    let mut response = render(&EmbeddedPage {
        frame: Frame::without_season(NO_ENTRY),
        view: EpisodeReplay {
            replay: ReplaySection {
                observed_url: None,
                is_embedded: true,
                ..view.replay
            },
            ..view
        },
    })?;
    response.extensions_mut().insert(Embeddable);
    Ok(response)
}

impl EpisodeReplay {
    async fn load(app: &App, viewer: Viewer, path: EpisodePath) -> Result<Self, Problem> {
        let EpisodePath { id, task, episode } = path;
        let visibility = Visibility::load(app, viewer).await?;
        let clips = Clips::find(app, &visibility, id).await?;
        let clip = clips.episode(task, episode).await?;
        let summary = &clip.summary;
        let competition = app.config.competition();
        let team = app.store.team(clips.evaluation.team).await?;
        let day = clips.evaluation.stage_day.date;
        let api = format!("{}/episodes/{task}/{episode}", paths::evaluation(id));
        Ok(Self {
            id,
            task,
            episode,
            team: team.name.to_string(),
            day,
            aim: competition
                .task(task)
                .map(|info| info.aim.clone())
                .unwrap_or_default(),
            success: summary.success,
            violations: summary
                .violations
                .iter()
                .map(|violation| describe_violation(competition, violation))
                .collect(),
            late_answers: summary.late_answers,
            duration_s: format!("{:.2}", competition.duration_s(task, summary.steps)),
            replay: ReplaySection::new(
                &clip,
                &api,
                format!("{task}, episode {episode}, {}", team.name),
                format!("{}, {task} {episode}, {day}", team.name),
            ),
            script: assets::REPLAY_SCRIPT.url(),
            styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
            previous: clip.has_previous.then(|| page_path(id, task, episode - 1)),
            next: clip.has_next.then(|| page_path(id, task, episode + 1)),
            failed: FailedEpisodes::load(&clips, path).await?,
        })
    }
}

impl FailedEpisodes {
    async fn load(clips: &Clips, path: EpisodePath) -> Result<Self, Problem> {
        let EpisodePath { id, task, episode } = path;
        let lines = clips.episodes().await?.episodes.into_iter();
        let failed: Vec<u32> = lines
            .filter(|summary| summary.task == task && !summary.success && summary.has_clips())
            .map(|summary| summary.episode)
            .collect();
        let [previous, next] = neighbours(failed.iter().copied(), episode)
            .map(|other| other.map(|other| page_path(id, task, other)));
        Ok(Self {
            count: failed.len(),
            place: failed
                .contains(&episode)
                .then(|| failed.iter().filter(|other| **other <= episode).count()),
            previous,
            next,
        })
    }
}

pub(super) fn page_path(id: EvaluationId, task: Task, episode: u32) -> String {
    format!("/evaluations/{id}/episodes/{task}/{episode}")
}

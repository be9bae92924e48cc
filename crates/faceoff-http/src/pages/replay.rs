//! `/evaluations/{id}/episodes/{task}/{episode}`: an episode, drawn; and the same without anything around it, for other sites.

use super::{
    assets,
    episode_words::in_words,
    frame::{Frame, PageProblem, render},
    table_drawing::{self, Dot, Ground},
};
use crate::{
    app::App,
    episode_path::EpisodePath,
    layers::Embeddable,
    paths,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, season::SeasonHead, sight::Sight},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_replay::{
    Clip,
    model::{CONTROL_STEP_S, PUCK, TOOL},
};
use faceoff_types::{EvaluationId, Task};
use jiff::civil::Date;

/// The episode as a picture that does not move.
struct Still {
    ground: Ground,
    puck_way: String,
    mallet_way: String,
    opponent_way: String,
    /// Where the agent was told that the puck is.
    seen: String,
    contacts: String,
    start: Dot,
    puck: Dot,
    mallet: Dot,
    puck_radius: f64,
    mallet_radius: f64,
}

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
    /// On somebody else's page?
    embedded: bool,
    steps: u32,
    duration_s: String,
    still: Still,
    /// Where the script finds the clips.
    motion: String,
    observed: Option<String>,
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

/// An episode's replay.
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
            observed: None,
            embedded: true,
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
        let (line, observed) = (&shown.line, shown.observed.as_ref());
        let team = app.store.team(clips.evaluation.team).await?;
        let api = format!("{}/episodes/{task}/{episode}", paths::evaluation(id));
        Ok(Self {
            id,
            task,
            episode,
            team: team.name.to_string(),
            day: clips.evaluation.of.date,
            success: line.success,
            why: line.why.clone(),
            broken: line.broken.iter().map(in_words).collect(),
            embedded: false,
            late: if clips.sees_observed { line.late } else { 0 },
            steps: line.steps,
            duration_s: format!("{:.2}", f64::from(line.steps) * CONTROL_STEP_S),
            still: Still::of(&shown.motion, observed),
            observed: observed.map(|_| format!("{api}/observed")),
            motion: format!("{api}/motion"),
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

impl Still {
    fn of(motion: &Clip, observed: Option<&Clip>) -> Self {
        let [puck, mallet] = [motion.puck_places(), motion.mallet_places(0)];
        let contacts = motion.header.contacts.iter();
        let contacts: Vec<[f64; 2]> = contacts.map(|contact| [contact.x, contact.y]).collect();
        let millimetres = |m: f64| (m * 1e4).round() / 10.0;
        let dot = |place: Option<&[f64; 2]>| Dot::at(place.copied().unwrap_or_default());
        Self {
            ground: Ground::new(),
            start: dot(puck.first()),
            puck: dot(puck.last()),
            mallet: dot(mallet.last()),
            puck_way: table_drawing::way(&puck),
            mallet_way: table_drawing::way(&mallet),
            opponent_way: table_drawing::way(&motion.mallet_places(1)),
            seen: observed
                .map_or_else(String::new, |clip| table_drawing::dots(&clip.seen_places())),
            contacts: table_drawing::squares(&contacts),
            puck_radius: millimetres(PUCK.radius_m),
            mallet_radius: millimetres(TOOL.cylinder_radius_m),
        }
    }
}

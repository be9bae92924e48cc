//! `/submissions/{id}/ablation/{profile}/{task}/{episode}`: an episode in the ideal simulator and with a perturbation.

use crate::{
    assets,
    frame::{Frame, PageProblem, render},
    side_by_side::Side,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::paths;
use faceoff_service::{
    app::App,
    episode_path::AblationPath,
    problem::Problem,
    viewer::Viewer,
    views::{
        ablation_clips::{AblationClips, Differing},
        season::SeasonHead,
        submission, team,
    },
};
use faceoff_types::{Profile, SubmissionId, Task};

#[derive(Template)]
#[template(path = "ablation_pair.html")]
struct Page {
    frame: Frame,
    id: SubmissionId,
    team: String,
    profile: Profile,
    task: Task,
    episode: u32,
    sides: Vec<Side>,
    /// The nearest episodes of the task that differ.
    before: Option<u32>,
    after: Option<u32>,
    styles: [&'static str; 2],
    script: &'static str,
}

/// An episode of an ablation, twice.
pub(crate) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<AblationPath, Problem>,
) -> Result<Response, PageProblem> {
    let AblationPath {
        submission: id,
        profile,
        task,
        episode,
    } = path?;
    let clips = AblationClips::of(&app, viewer?, id).await?;
    let mut sides = Vec::new();
    for (element, of) in [("replay-a", Profile::Ideal), ("replay-b", profile)] {
        let found = clips.episode(&app, of, task, episode).await?;
        let api = format!("{}/ablation/{of}/{task}/{episode}", paths::submission(id));
        sides.push(Side::of(element, &found, &api, of.to_string()));
    }
    let differing = clips.differing(&app).await?;
    let of_task = || {
        let all = differing.get(&profile).into_iter().flatten();
        let of_task = all.filter(|Differing { ideal, .. }| ideal.task == task);
        of_task.map(|Differing { ideal, .. }| ideal.episode)
    };
    let submission = submission::find(&app, id).await?;
    let team = team::find(&app, submission.team).await?;
    let season = SeasonHead::now(&app).await?;
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        id,
        team: team.name.to_string(),
        profile,
        task,
        episode,
        sides,
        before: of_task().filter(|other| *other < episode).max(),
        after: of_task().filter(|other| *other > episode).min(),
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })
}

//! `/submissions/{id}/ablation/{profile}/{task}/{episode}`: an episode in the ideal simulator and with a perturbation, side by
//! side.

use crate::{
    assets,
    frame::{Frame, NO_ENTRY, PageProblem, render},
    side_by_side::{Side, neighbours},
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
        ablation_clips::{AblationClips, DifferingEpisode},
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
    /// The nearest episodes of the task with different outcomes.
    previous_difference: Option<u32>,
    next_difference: Option<u32>,
    styles: [&'static str; 2],
    script: &'static str,
}

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
    let clips = AblationClips::load(&app, viewer?, id).await?;
    let mut sides = Vec::new();
    let ideal = app.config.competition().ideal_profile;
    for (element_id, shown_profile) in [("replay-a", ideal), ("replay-b", profile)] {
        let clip = clips.episode(&app, shown_profile, task, episode).await?;
        let api = format!(
            "{}/ablation/{shown_profile}/{task}/{episode}",
            paths::submission(id)
        );
        sides.push(Side::new(
            app.config.competition(),
            element_id,
            &clip,
            &api,
            shown_profile.to_string(),
        ));
    }
    let differing = clips.differing_episodes(&app).await?;
    let of_profile = differing.get(&profile).into_iter().flatten();
    let of_task = of_profile.filter(|DifferingEpisode { ideal, .. }| ideal.task == task);
    let numbers = of_task.map(|DifferingEpisode { ideal, .. }| ideal.episode);
    let [previous_difference, next_difference] = neighbours(numbers, episode);
    let submission = submission::find(&app, id).await?;
    let team = team::find(&app, submission.team).await?;
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY).await?,
        id,
        team: team.name.to_string(),
        profile,
        task,
        episode,
        sides,
        previous_difference,
        next_difference,
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })
}

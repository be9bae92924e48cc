//! `/evaluations/{a}/compare/{b}/{task}/{episode}`: one episode as both played it, side by side and in step.

use crate::{
    assets,
    frame::{Frame, PageProblem, render},
    replay::page_path,
    side_by_side::Side,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::{paths, requests::ComparisonQuery, views::comparison::ComparedView};
use faceoff_scoring::WhoSolved;
use faceoff_service::{
    app::App,
    extract::PathParams,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clips::Clips, comparison, season::SeasonHead, sight::Sight},
};
use faceoff_types::{EvaluationId, Task};
use jiff::civil::Date;

#[derive(Template)]
#[template(path = "comparison_pair.html")]
struct Page {
    frame: Frame,
    ids: [EvaluationId; 2],
    task: Task,
    episode: u32,
    day: Date,
    teams: [String; 2],
    sides: Vec<Side>,
    /// The nearest episodes of the task that one alone solved.
    before: Option<u32>,
    after: Option<u32>,
    styles: [&'static str; 2],
    script: &'static str,
}

/// An episode of two evaluations.
pub(crate) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<PathParams<String, 4>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParams([a, b, task, episode]) = path?;
    let nothing = || Problem::new(ProblemKind::NotFound, "there is no such episode of both");
    let id = |text: &str| text.parse::<EvaluationId>().map_err(|_| nothing());
    let ids = [id(&a)?, id(&b)?];
    let task: Task = task.parse().map_err(|_| nothing())?;
    let episode: u32 = episode.parse().map_err(|_| nothing())?;
    let sight = Sight::of(&app, viewer?).await?;
    let query = ComparisonQuery { episodes: true };
    let view = comparison::of(&app, &sight, ids, query).await?;
    let sides = [
        side(&app, &sight, &view.a, "replay-a", (task, episode)).await?,
        side(&app, &sight, &view.b, "replay-b", (task, episode)).await?,
    ];
    let who = view.episodes.as_ref().and_then(|all| all.get(&task));
    let [before, after] = who.map_or([None; 2], |who| beside(who, episode));
    let season = SeasonHead::now(&app).await?;
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        ids,
        task,
        episode,
        day: view.day,
        teams: [&view.a, &view.b].map(|side| side.team.to_string()),
        sides: sides.into(),
        before,
        after,
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })
}

async fn side(
    app: &App,
    sight: &Sight,
    of: &ComparedView,
    id: &'static str,
    (task, episode): (Task, u32),
) -> Result<Side, Problem> {
    let clips = Clips::of(app, sight, of.evaluation).await?;
    let found = clips.episode(task, episode).await?;
    let api = format!(
        "{}/episodes/{task}/{episode}",
        paths::evaluation(of.evaluation)
    );
    Ok(Side {
        path: Some(page_path(of.evaluation, task, episode)),
        ..Side::of(id, &found, &api, of.team.to_string())
    })
}

/// The nearest episodes before and after this one that one of the two alone solved.
fn beside(who: &WhoSolved, episode: u32) -> [Option<u32>; 2] {
    let differing = || who.only_a.iter().chain(&who.only_b).copied();
    [
        differing().filter(|other| *other < episode).max(),
        differing().filter(|other| *other > episode).min(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_that_differ_are_found_whoever_solved_them() {
        let who = WhoSolved {
            both: vec![2],
            only_a: vec![0, 7],
            only_b: vec![3, 9],
            neither: vec![5],
        };
        assert_eq!(beside(&who, 5), [Some(3), Some(7)]);
        assert_eq!(beside(&who, 0), [None, Some(3)]);
        assert_eq!(beside(&who, 9), [Some(7), None]);
    }
}

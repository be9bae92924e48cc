//! `/evaluations/{a}/compare/{b}/{task}/{episode}`: an episode of two evaluations, side by side.

use crate::{
    assets,
    frame::{Frame, NO_ENTRY, PageProblem, render},
    replay::page_path,
    side_by_side::{Side, neighbours},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::{paths, requests::ComparisonQuery, views::comparison::ComparedView};
use faceoff_scoring::SolvedEpisodes;
use faceoff_service::{
    app::App,
    extract::PathParams,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clips::Clips, comparison, visibility::Visibility},
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
    /// The nearest episodes of the task that only one team solved.
    previous_difference: Option<u32>,
    next_difference: Option<u32>,
    styles: [&'static str; 2],
    script: &'static str,
}

pub(crate) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<PathParams<String, 4>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParams([a, b, task, episode]) = path?;
    let not_found = || {
        Problem::new(
            ProblemKind::NotFound,
            "the evaluations have no such common episode",
        )
    };
    let id = |text: &str| text.parse::<EvaluationId>().map_err(|_| not_found());
    let ids = [id(&a)?, id(&b)?];
    let task: Task = task.parse().map_err(|_| not_found())?;
    let episode: u32 = episode.parse().map_err(|_| not_found())?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let query = ComparisonQuery { episodes: true };
    let view = comparison::compare(&app, &visibility, ids, query).await?;
    let sides = [
        side(&app, &visibility, &view.a, "replay-a", (task, episode)).await?,
        side(&app, &visibility, &view.b, "replay-b", (task, episode)).await?,
    ];
    let solved = view.episodes.as_ref().and_then(|all| all.get(&task));
    let [previous_difference, next_difference] =
        solved.map_or([None; 2], |solved| differing_neighbours(solved, episode));
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY).await?,
        ids,
        task,
        episode,
        day: view.day,
        teams: [&view.a, &view.b].map(|side| side.team.to_string()),
        sides: sides.into(),
        previous_difference,
        next_difference,
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })
}

async fn side(
    app: &App,
    visibility: &Visibility,
    evaluation: &ComparedView,
    element_id: &'static str,
    (task, episode): (Task, u32),
) -> Result<Side, Problem> {
    let clips = Clips::find(app, visibility, evaluation.evaluation).await?;
    let clip = clips.episode(task, episode).await?;
    let api = format!(
        "{}/episodes/{task}/{episode}",
        paths::evaluation(evaluation.evaluation)
    );
    Ok(Side {
        path: Some(page_path(evaluation.evaluation, task, episode)),
        ..Side::new(
            app.config.competition(),
            element_id,
            &clip,
            &api,
            evaluation.team.to_string(),
        )
    })
}

/// The nearest episodes before and after this one that only one team solved.
fn differing_neighbours(solved: &SolvedEpisodes, episode: u32) -> [Option<u32>; 2] {
    let differing = solved.only_a.iter().chain(&solved.only_b).copied();
    neighbours(differing, episode)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differing_neighbours_include_episodes_of_both_teams() {
        let solved = SolvedEpisodes {
            both: vec![2],
            only_a: vec![0, 7],
            only_b: vec![3, 9],
            neither: vec![5],
        };
        assert_eq!(differing_neighbours(&solved, 5), [Some(3), Some(7)]);
        assert_eq!(differing_neighbours(&solved, 0), [None, Some(3)]);
        assert_eq!(differing_neighbours(&solved, 9), [Some(7), None]);
    }
}
